# SPDX-License-Identifier: MIT
# What others use, beside the programs: the library and headers with which a user's own program reads
# the rings (pkg-config name: ecdaq), the licence texts, and what SOEM's licence asks to hand on.

# The include paths of the headers are those of the source tree: "base/ring.h", "image/image.h".
add_library(ecdaq_client STATIC $<TARGET_OBJECTS:ecdaq_base> $<TARGET_OBJECTS:ecdaq_image>
	$<TARGET_OBJECTS:ecdaq_reader>)
set_target_properties(ecdaq_client PROPERTIES OUTPUT_NAME ecdaq LINKER_LANGUAGE C)
add_library(ecdaq_client_shared SHARED $<TARGET_OBJECTS:ecdaq_base> $<TARGET_OBJECTS:ecdaq_image>
	$<TARGET_OBJECTS:ecdaq_reader>)
set_target_properties(ecdaq_client_shared PROPERTIES OUTPUT_NAME ecdaq LINKER_LANGUAGE C
	VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})
target_link_libraries(ecdaq_client_shared PRIVATE m)
install(TARGETS ecdaq_client ecdaq_client_shared
	ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES core/base/board.h core/base/clock.h core/base/event.h core/base/histogram.h core/base/limits.h core/base/ring.h
	core/base/sample.h core/base/status.h core/base/sync0.h core/base/timemap.h
	DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq/base)
# Control programs say <ecdaq/control.h>.
install(FILES master/control/control.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq)
install(FILES core/reader/feed.h core/reader/page.h core/reader/reader.h core/reader/table.h core/reader/utc.h
	DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq/reader)
install(FILES core/image/image.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq/image)

file(RELATIVE_PATH ECDAQ_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(cmake/ecdaq.pc.in ecdaq.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ecdaq.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

install(DIRECTORY examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/examples)
install(FILES ../LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/licenses)
install(DIRECTORY ../LICENSES/ DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/licenses)
install(FILES third_party/soem.lock third_party/fetch-soem.sh
	DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/soem)
install(FILES third_party/libgpiod.lock third_party/fetch-libgpiod.sh
	DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/libgpiod)
install(DIRECTORY third_party/patches DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/soem)
