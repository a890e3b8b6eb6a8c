# SPDX-License-Identifier: MIT
# What is installed beside the programs: completion and manual pages of ecdaq, and what others use: libecdaq with <ecdaq/reader.h> (pkg-config name ecdaq, CMake
# package ecdaq), <ecdaq/control.h>, the licence texts, and what SOEM's licence asks to hand on.

include(CMakePackageConfigHelpers)

# The tool itself writes its completion and pages. Where the building machine does not run the target's
# programs, CMAKE_CROSSCOMPILING_EMULATOR does.
if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
	message(FATAL_ERROR "ecdaq's manual pages are made by running it: set CMAKE_CROSSCOMPILING_EMULATOR "
		"(/usr/bin/env where binfmt_misc runs programs of ${CMAKE_SYSTEM_PROCESSOR})")
endif()
set(pages ${CMAKE_CURRENT_BINARY_DIR}/pages)
add_custom_command(OUTPUT ${pages}/ecdaq ${pages}/man1/ecdaq.1
	COMMAND ${CMAKE_COMMAND} -E rm -rf ${pages}
	COMMAND ${CMAKE_COMMAND} -E make_directory ${pages}/man1
	COMMAND ecdaq completion > ${pages}/ecdaq
	COMMAND ecdaq manual --write ${pages}/man1
	DEPENDS ecdaq VERBATIM)
add_custom_target(ecdaq_pages ALL DEPENDS ${pages}/ecdaq ${pages}/man1/ecdaq.1)
install(FILES ${pages}/ecdaq DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})

# Only ecdaq_* is visible to a program that links the library: everything else in it may change.
set(client_objects $<TARGET_OBJECTS:ecdaq_base> $<TARGET_OBJECTS:ecdaq_image> $<TARGET_OBJECTS:ecdaq_reader>)
set(client_object ${CMAKE_CURRENT_BINARY_DIR}/ecdaq_client.o)
add_custom_command(OUTPUT ${client_object}
	COMMAND ${CMAKE_LINKER} -r -o ${client_object} ${client_objects}
	COMMAND ${CMAKE_OBJCOPY} --wildcard --keep-global-symbol=ecdaq_* ${client_object}
	DEPENDS ecdaq_base ecdaq_image ecdaq_reader ${client_objects}
	COMMAND_EXPAND_LISTS VERBATIM)
add_library(ecdaq_client STATIC ${client_object})
set_target_properties(ecdaq_client PROPERTIES OUTPUT_NAME ecdaq EXPORT_NAME static LINKER_LANGUAGE C)
target_link_libraries(ecdaq_client INTERFACE m)

# The number of the binary interface: one more where a program that is linked already would not run any longer.
set(client_abi 1)
set(client_symbols ${CMAKE_CURRENT_SOURCE_DIR}/cmake/libecdaq.map)
add_library(ecdaq_client_shared SHARED ${client_objects})
set_target_properties(ecdaq_client_shared PROPERTIES OUTPUT_NAME ecdaq EXPORT_NAME ecdaq LINKER_LANGUAGE C
	VERSION ${client_abi}.${PROJECT_VERSION} SOVERSION ${client_abi} LINK_DEPENDS ${client_symbols})
target_link_options(ecdaq_client_shared PRIVATE "-Wl,--version-script=${client_symbols}")
target_link_libraries(ecdaq_client_shared PRIVATE m)

foreach(target ecdaq_client ecdaq_client_shared)
	target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endforeach()
install(TARGETS ecdaq_client ecdaq_client_shared EXPORT ecdaq
	ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES core/reader/api.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq RENAME reader.h)
install(FILES master/control/control.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecdaq)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ecdaq)
install(EXPORT ecdaq NAMESPACE ecdaq:: FILE ecdaqConfig.cmake DESTINATION ${package_dir})
write_basic_package_version_file(ecdaqConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ecdaqConfigVersion.cmake DESTINATION ${package_dir})
file(RELATIVE_PATH ECDAQ_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(cmake/ecdaq.pc.in ecdaq.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ecdaq.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# The CMakeLists.txt of the folder itself belongs to this tree; that of reader/ is the user's.
install(DIRECTORY examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/examples
	REGEX "examples/CMakeLists.txt$" EXCLUDE)
install(FILES ../LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/licenses)
install(DIRECTORY ../LICENSES/ DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/licenses)
install(FILES third_party/soem.lock third_party/fetch-soem.sh
	DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/soem)
install(FILES third_party/libgpiod.lock third_party/fetch-libgpiod.sh
	DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/libgpiod)
install(DIRECTORY third_party/patches DESTINATION ${CMAKE_INSTALL_DATADIR}/ecdaq/soem)
