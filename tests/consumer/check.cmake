# Installs Fathom to an empty prefix, then configures, builds and runs the consumer against it: through CMake, and if
# there is a pkg-config file, through that too.
#   cmake -D FATHOM_BUILD=… -D WORK=… -D GENERATOR=… -D COMPILER=… -D LINK_FLAGS=… -P check.cmake
function(must_run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed: ${command}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK}")
must_run("${CMAKE_COMMAND}" --install "${FATHOM_BUILD}" --prefix "${WORK}/prefix")
must_run("${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}" -B "${WORK}/build" -G "${GENERATOR}"
  "-DCMAKE_PREFIX_PATH=${WORK}/prefix" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_EXE_LINKER_FLAGS=${LINK_FLAGS}"
  -DCMAKE_BUILD_TYPE=Release)
must_run("${CMAKE_COMMAND}" --build "${WORK}/build")
must_run("${WORK}/build/consumer")
must_run("${WORK}/build/components")
file(GLOB_RECURSE notes "${WORK}/prefix/share/doc/*/copyright")
if(NOT notes)
  message(FATAL_ERROR "the licence is not installed")
endif()

file(GLOB_RECURSE pc "${WORK}/prefix/fathom.pc")
find_program(PKG_CONFIG pkg-config)
if(pc AND PKG_CONFIG)
  get_filename_component(folder "${pc}" DIRECTORY)
  get_filename_component(libraries "${folder}" DIRECTORY)
  execute_process(COMMAND "${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" "${PKG_CONFIG}" --cflags --libs fathom
    OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags)
  separate_arguments(link_flags UNIX_COMMAND "${LINK_FLAGS}")
  must_run("${COMPILER}" -std=c++20 "${CMAKE_CURRENT_LIST_DIR}/main.cpp" -o "${WORK}/by-pkg-config" ${flags} ${link_flags}
    "-Wl,-rpath,${libraries}")
  must_run("${WORK}/by-pkg-config")
endif()
