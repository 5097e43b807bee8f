# Installs Fathom to an empty prefix, then configures, builds and runs the consumer against it.
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
