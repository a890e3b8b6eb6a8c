// SPDX-License-Identifier: MIT
// Print the events that ecdaqd still holds:  events [RUN_DIR]
#include <ecdaq/reader.h>

#include <iostream>
#include <memory>

int main(int argc, char **argv)
{
	ecdaq_events *opened = nullptr;

	if (ecdaq_events_open(argc > 1 ? argv[1] : nullptr, ECDAQ_FROM_OLDEST, &opened) < 0) {
		return 1;
	}
	const std::unique_ptr<ecdaq_events, void (*)(ecdaq_events *)> events(opened,
									     ecdaq_events_close);
	while (const ecdaq_event *event = ecdaq_events_next(events.get())) {
		std::cout << event->cycle << ' ' << event->severity << ' ' << event->text << '\n';
	}
	std::cerr << ecdaq_events_lost(events.get()) << " events were lost\n";
	return 0;
}
