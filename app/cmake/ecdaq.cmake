# SPDX-License-Identifier: MIT
# How a module, a program and a test of ecdaq are declared. One way each.

set(ECDAQ_WARNINGS
	-Wall -Wextra -Wshadow -Wconversion -Wswitch-enum -Wmissing-prototypes -Wstrict-prototypes
	-Wcast-align -Wwrite-strings -Wundef -Wvla -Wformat=2 -Werror)

add_library(ecdaq_options INTERFACE)
target_compile_options(ecdaq_options INTERFACE ${ECDAQ_WARNINGS})
target_compile_definitions(ecdaq_options INTERFACE _GNU_SOURCE ECDAQ_VERSION="${PROJECT_VERSION}")

# Tests may include every wing.
add_library(ecdaq_all_wings INTERFACE)
target_link_libraries(ecdaq_all_wings INTERFACE ecdaq_options)
target_include_directories(ecdaq_all_wings INTERFACE "${CMAKE_SOURCE_DIR}/core" "${CMAKE_SOURCE_DIR}/master"
	"${CMAKE_SOURCE_DIR}/services" "${CMAKE_SOURCE_DIR}/sim" "${CMAKE_SOURCE_DIR}")

# ecdaq_wing_includes(TARGET): sources in a folder of app/ include core/ and their own wing, by the
# name of the module: "base/ring.h", "cycle/cycle.h". The cli is one module: "cli/text.h".
function(ecdaq_wing_includes target)
	file(RELATIVE_PATH place "${CMAKE_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
	string(REGEX REPLACE "/.*" "" wing "${place}")
	target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}/core")
	if(wing STREQUAL "cli")
		target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}")
	else()
		target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}/${wing}")
	endif()
endfunction()

# Always optimised: gcc finds unset variables only then. No NDEBUG: assertions stay on everywhere.
if(NOT CMAKE_BUILD_TYPE)
	set(CMAKE_BUILD_TYPE Release)
endif()
if(ECDAQ_SANITIZE)
	set(CMAKE_C_FLAGS_RELEASE "-O1 -g")
else()
	set(CMAKE_C_FLAGS_RELEASE "-O2 -g")
endif()

if(ECDAQ_SANITIZE)
	add_compile_options(-fsanitize=${ECDAQ_SANITIZE} -fno-omit-frame-pointer -g)
	add_link_options(-fsanitize=${ECDAQ_SANITIZE})
	if(ECDAQ_SANITIZE MATCHES "undefined")
		add_compile_options(-fno-sanitize-recover=all)
	endif()
	if(ECDAQ_SANITIZE MATCHES "thread" AND CMAKE_C_COMPILER_ID STREQUAL "GNU")
		add_compile_options(-Wno-tsan)
	endif()
endif()
if(ECDAQ_FUZZ)
	add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(ECDAQ_COVERAGE)
	add_compile_options(-fprofile-instr-generate -fcoverage-mapping)
	add_link_options(-fprofile-instr-generate)
endif()

# ecdaq_module(NAME SOURCES a.c b.c [DEPENDS module...] [LIBRARIES lib...])
# A static library ecdaq_NAME. DEPENDS names other modules, LIBRARIES foreign ones.
function(ecdaq_module name)
	cmake_parse_arguments(M "" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
	add_library(ecdaq_${name} STATIC ${M_SOURCES})
	target_link_libraries(ecdaq_${name} PRIVATE ecdaq_options)
	ecdaq_wing_includes(ecdaq_${name})
	foreach(dep ${M_DEPENDS})
		target_link_libraries(ecdaq_${name} PUBLIC ecdaq_${dep})
	endforeach()
	target_link_libraries(ecdaq_${name} PUBLIC ${M_LIBRARIES})
endfunction()

# ecdaq_program(NAME SOURCES a.c [DEPENDS module...] [LIBRARIES lib...])
# An executable NAME, installed to bin.
function(ecdaq_program name)
	cmake_parse_arguments(P "" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
	add_executable(${name} ${P_SOURCES})
	target_link_libraries(${name} PRIVATE ecdaq_options)
	ecdaq_wing_includes(${name})
	foreach(dep ${P_DEPENDS})
		target_link_libraries(${name} PRIVATE ecdaq_${dep})
	endforeach()
	target_link_libraries(${name} PRIVATE ${P_LIBRARIES})
	install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

# ecdaq_targets_below(DIRECTORY VARIABLE): all targets of a directory and of those it has added so far.
function(ecdaq_targets_below directory variable)
	get_property(targets DIRECTORY "${directory}" PROPERTY BUILDSYSTEM_TARGETS)
	get_property(below DIRECTORY "${directory}" PROPERTY SUBDIRECTORIES)
	foreach(subdirectory ${below})
		ecdaq_targets_below("${subdirectory}" more)
		list(APPEND targets ${more})
	endforeach()
	set(${variable} ${targets} PARENT_SCOPE)
endfunction()

# ecdaq_test(GROUP NAME SOURCES a.c [DEPENDS module...] [LIBRARIES lib...] [TIMEOUT s of CPU time] [LABELS long] [WHOLE])
# An executable GROUP_NAME on tests/harness; every TEST(module, sentence) in its sources becomes
# one ctest test "module.sentence" with label GROUP. LABELS long: not under the sanitizers. WHOLE: one
# more test, whole.GROUP_NAME, runs all of them in one process: none may leave state to the next.
function(ecdaq_test group name)
	cmake_parse_arguments(T "WHOLE" "TIMEOUT" "SOURCES;DEPENDS;LIBRARIES;LABELS" ${ARGN})
	set(exe ${group}_${name})
	add_executable(${exe} ${T_SOURCES})
	target_link_libraries(${exe} PRIVATE ecdaq_all_wings ecdaq_harness)
	foreach(dep ${T_DEPENDS})
		target_link_libraries(${exe} PRIVATE ecdaq_${dep})
	endforeach()
	target_link_libraries(${exe} PRIVATE ${T_LIBRARIES})
	if(NOT T_TIMEOUT)
		set(T_TIMEOUT 120)
	endif()
	math(EXPR wall_seconds "10 * ${T_TIMEOUT}")
	if(T_WHOLE)
		add_test(NAME whole.${exe} COMMAND ${exe})
		set_tests_properties(whole.${exe} PROPERTIES LABELS "${group};${T_LABELS}"
			ENVIRONMENT "ECDAQ_TEST_CPU_SECONDS=${T_TIMEOUT}" TIMEOUT ${wall_seconds}
			SKIP_RETURN_CODE 77)
	endif()
	foreach(source ${T_SOURCES})
		set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
		file(STRINGS ${source} lines REGEX "^TEST\\([a-z0-9_]+, *[a-z0-9_]+\\)")
		foreach(line ${lines})
			string(REGEX REPLACE "^TEST\\(([a-z0-9_]+), *([a-z0-9_]+)\\).*" "\\1.\\2" full "${line}")
			add_test(NAME ${full} COMMAND ${exe} ${full})
			# The harness limits the CPU time; the wall time only ends a deadlock.
			set_tests_properties(${full} PROPERTIES LABELS "${group};${T_LABELS}"
				ENVIRONMENT "ECDAQ_TEST_CPU_SECONDS=${T_TIMEOUT}" TIMEOUT ${wall_seconds}
				SKIP_RETURN_CODE 77)
		endforeach()
	endforeach()
endfunction()
