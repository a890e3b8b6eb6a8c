/* SPDX-License-Identifier: MIT */
#include "cli/doctor/irq.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

int irq_parse(const char *line, struct irq *ret)
{
	struct irq irq = { .count = 0 };
	char *end;
	long number = strtol(line, &end, 10);
	size_t len;

	if (end == line || *end != ':' || number < 0 || number > INT32_MAX) {
		return -EBADMSG;
	}
	irq.number = (int)number;
	for (line = end + 1;; line = end) {
		unsigned long long count;

		line += strspn(line, " ");
		count = strtoull(line, &end, 10);
		/* A controller's name may begin with a digit: a count ends with a blank. */
		if (end == line || (*end != ' ' && *end != '\n')) {
			break;
		}
		irq.count += count;
	}
	len = strcspn(line, "\n");
	/* The user stands at the end. */
	if (len >= sizeof(irq.name)) {
		line += len - (sizeof(irq.name) - 1);
		len = sizeof(irq.name) - 1;
	}
	memcpy(irq.name, line, len);
	*ret = irq;
	return 0;
}

int irq_is_of(const struct irq *irq, const char *user)
{
	size_t len = strlen(user);
	const char *at = irq->name;

	while (len > 0 && (at = strstr(at, user)) != NULL) {
		char before = at == irq->name ? ' ' : at[-1];
		char behind = at[len];

		if ((before == ' ' || before == ',') && !isalnum((unsigned char)behind)) {
			return 1;
		}
		at++;
	}
	return 0;
}

int irq_list(const struct sight *s, struct irq irqs[IRQ_MAX])
{
	FILE *file = sight_open(s, "/proc/interrupts");
	char *line = NULL;
	size_t bytes = 0;
	int count = 0;

	if (file == NULL) {
		return -errno;
	}
	while (count < IRQ_MAX && getline(&line, &bytes, file) > 0) {
		if (irq_parse(line, &irqs[count]) == 0) {
			count++;
		}
	}
	free(line);
	fclose(file);
	return count;
}

int irq_cores(const struct sight *s, int number, char ret_list[SIGHT_TEXT_BYTES])
{
	int r = sight_text(s, ret_list, "/proc/irq/%d/effective_affinity_list", number);

	/* Empty for one that each core has of its own (its timer), or that nobody uses. */
	if (r == 0) {
		ret_list[0] = '\0';
	} else if (r < 0) {
		/* Not there: the kernel does not tell where an interrupt really fires. */
		r = sight_text(s, ret_list, "/proc/irq/%d/smp_affinity_list", number);
	}
	return r < 0 ? r : 0;
}
