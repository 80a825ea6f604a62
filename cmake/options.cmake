# How everything is compiled, and the two functions with which each folder says what it holds.

# No contraction into fused multiply-adds (accuracy.md, section 4): the bits must not depend on the CPU. -Ofast is for the
# compiler study alone (scripts/compilers), whose strict programs judge what it draws; as a compile option only, since on a
# link line it would make the whole process flush denormals.
if(RASTERBENCH_FAST_MATH)
  set(rasterbench_arithmetic -Ofast -ffp-contract=fast)
else()
  set(rasterbench_arithmetic -ffp-contract=off)
endif()
add_library(rasterbench_options INTERFACE)
target_include_directories(rasterbench_options INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/generated)
target_compile_options(rasterbench_options INTERFACE
  ${rasterbench_arithmetic} -Wall -Wextra -Wconversion -Wshadow -Wpedantic
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # false alarms on string + string in GCC 12 (bug 105651)
  $<$<BOOL:${RASTERBENCH_WERROR}>:-Werror>)
target_link_libraries(rasterbench_options INTERFACE fmt::fmt Threads::Threads)
if(RASTERBENCH_SANITIZE)
  target_compile_options(rasterbench_options INTERFACE
    -fsanitize=${RASTERBENCH_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)  # false alarms in instrumented <regex> (GCC bug 105562)
  target_link_options(rasterbench_options INTERFACE -fsanitize=${RASTERBENCH_SANITIZE})
endif()

# What -march=native is compiled with is not what the check of the CPU may be compiled with: see harness/cpu_check.
add_library(rasterbench_native INTERFACE)
if(RASTERBENCH_NATIVE)
  target_compile_options(rasterbench_native INTERFACE -march=native)
endif()

# rasterbench_library(NAME sources...): the objects of a folder. Objects, not an archive: kernels, schedules and
# generators register themselves from namespace scope, and a linker drops archive members that nobody names.
function(rasterbench_library name)
  add_library(${name} OBJECT ${ARGN})
  target_link_libraries(${name} PUBLIC rasterbench_options rasterbench_native)
endfunction()

# Highway's targets are those of the axis of instruction sets, whatever the compiler, its flags and the version of Highway. Without
# this the baseline would not be one lane but an emulated vector under clang and newer versions of GCC, or SSE2 in later Highways.
add_library(rasterbench_highway INTERFACE)
target_link_libraries(rasterbench_highway INTERFACE PkgConfig::hwy)
target_compile_definitions(rasterbench_highway INTERFACE
  HWY_BROKEN_EMU128=1 HWY_BASELINE_TARGETS=HWY_SCALAR "HWY_DISABLED_TARGETS=~(HWY_SCALAR|HWY_SSE4|HWY_AVX2|HWY_AVX3)")

# rasterbench_lanes(FOLDER sources...): sources that Highway compiles for each instruction set, as objects of FOLDER.
function(rasterbench_lanes folder)
  add_library(${folder}_lanes OBJECT ${ARGN})
  target_link_libraries(${folder}_lanes PUBLIC rasterbench_options rasterbench_highway)
  target_sources(${folder} PUBLIC $<TARGET_OBJECTS:${folder}_lanes>)
endfunction()

# rasterbench_unoptimised(TARGETS...): compiles them at -O0 under sanitizers, in half of the time or less. For unit tests and
# for folders that hardly compute. No check is lost: an optimiser removes checks, it adds none. The stages, kernels and
# references, in which tests spend their time, stay at the -O1 of the preset.
function(rasterbench_unoptimised)
  if(RASTERBENCH_SANITIZE)
    foreach(target ${ARGN})
      target_compile_options(${target} PRIVATE -O0)
    endforeach()
  endif()
endfunction()

# What sanitizers need: the programs need not be compiled a second time.
add_custom_target(unit_tests)

# rasterbench_test(FOLDER sources... LIBRARIES folders...): FOLDER_test, the unit tests that sit beside the sources.
function(rasterbench_test folder)
  cmake_parse_arguments(ARG "" "" "LIBRARIES" ${ARGN})
  add_executable(${folder}_test ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${folder}_test PRIVATE ${ARG_LIBRARIES} GTest::gtest_main)
  rasterbench_unoptimised(${folder}_test)
  add_dependencies(unit_tests ${folder}_test)
  # Tests run side by side, on more threads than CPUs: waiting threads that spin would take the CPU from those they wait for.
  gtest_discover_tests(${folder}_test TEST_PREFIX "${folder}." DISCOVERY_TIMEOUT 60
                       PROPERTIES ENVIRONMENT OMP_WAIT_POLICY=passive)
endfunction()
