# generated/build_info.h: what was built, by what, from which commit. Renewed at every build, rewritten when it changes.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type_upper)
list(JOIN rasterbench_arithmetic " " build_arithmetic)
set(build_flags "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type_upper}} ${build_arithmetic}")
if(RASTERBENCH_NATIVE)
  string(APPEND build_flags " -march=native")
endif()
if(RASTERBENCH_SANITIZE)
  string(APPEND build_flags " -fsanitize=${RASTERBENCH_SANITIZE}")
endif()
string(STRIP "${build_flags}" build_flags)
add_custom_target(build_info
  COMMAND ${CMAKE_COMMAND}
    "-DSOURCE_DIR=${PROJECT_SOURCE_DIR}" "-DOUTPUT=${PROJECT_BINARY_DIR}/generated/build_info.h"
    "-DVERSION=${PROJECT_VERSION}" "-DBUILD_TYPE=${CMAKE_BUILD_TYPE}" "-DFLAGS=${build_flags}"
    "-DCOMPILER=${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}"
    "-DBENCHMARK=${benchmark_VERSION}" "-DTBB=${TBB_VERSION}"
    -P ${PROJECT_SOURCE_DIR}/cmake/write_build_info.cmake
  BYPRODUCTS ${PROJECT_BINARY_DIR}/generated/build_info.h
  VERBATIM)
