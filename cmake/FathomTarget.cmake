# Which checks of src/check are compiled in: 0 none, 1 the cheap ones, 2 all.
if(FATHOM_CHECKS STREQUAL "AUTO")
  if(FATHOM_SANITIZE OR CMAKE_BUILD_TYPE STREQUAL "Debug")
    set(FATHOM_CHECK_LEVEL 2)
  elseif(CMAKE_BUILD_TYPE MATCHES "^(Release|MinSizeRel)$")
    set(FATHOM_CHECK_LEVEL 0)
  else()
    set(FATHOM_CHECK_LEVEL 1)
  endif()
elseif(FATHOM_CHECKS)
  set(FATHOM_CHECK_LEVEL 2)
else()
  set(FATHOM_CHECK_LEVEL 0)
endif()

# Flags every target of this project is built with.
function(fathom_target target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  if(FATHOM_CHECK_LEVEL)
    target_compile_definitions(${target} PRIVATE FATHOM_CHECKS=${FATHOM_CHECK_LEVEL})
  endif()
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  set(flags
    -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wdouble-promotion
    $<$<BOOL:${FATHOM_WARNINGS_AS_ERRORS}>:-Werror>
    # g++ 12 sees overlaps in every "literal" + std::string (GCC bug 105651).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
    # libstdc++ 12 sorts with what it calls deprecated.
    $<$<AND:$<CXX_COMPILER_ID:Clang>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,15>>:-Wno-deprecated-declarations>
    # Same bits on every compiler and target: no contraction of a·b + c.
    # g++ before 12.3 fuses them all the same where it vectorises straight-line code (GCC bug 107647).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,12.3>>:-fno-tree-slp-vectorize>
    -ffp-contract=off -fno-math-errno -fno-trapping-math
    # The compiler collects garbage from 1 GB on (kB): a twentieth of its time, and most sources never get there.
    $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1000000>)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    # The floor: AVX2 and fma. Wider code is chosen at run time (src/native).
    list(APPEND flags -march=x86-64-v3)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64|ARM64")
    # What Highway's NEON target asks for.
    list(APPEND flags -march=armv8-a+crypto)
  endif()
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${flags};-Wpedantic>")
  if(FATHOM_WITH_CUDA)
    # The same for the host's half of a .cu file; what nvcc writes for it is not pedantic.
    # Division and square root are correctly rounded by default (-prec-div, -prec-sqrt).
    # CMake 3.25 does not know nvcc's C++20, hence the flag.
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=$<JOIN:${flags},$<COMMA>>>"
      "$<$<COMPILE_LANGUAGE:CUDA>:-std=c++20;--fmad=false;--expt-relaxed-constexpr>"
      "$<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${FATHOM_WARNINGS_AS_ERRORS}>>:-Werror=all-warnings>")
    # Linked by name instead (cmake/FathomCuda.cmake), so that users of the installed archive link it too.
    set_target_properties(${target} PROPERTIES CUDA_RUNTIME_LIBRARY None)
  endif()
  if(FATHOM_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${FATHOM_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${FATHOM_SANITIZE})
    if(FATHOM_SANITIZE MATCHES "undefined")
      target_compile_options(${target} PRIVATE -fno-sanitize-recover=undefined)
      # With each lane access of the constraint kernels checked, if only for its address, g++ had not finished after 20
      # minutes and 7 GB; without, at -O1, it takes two. They are arithmetic on rows that their callers hand over.
      set_source_files_properties(src/native/solver_kernels.cpp PROPERTIES COMPILE_OPTIONS "-fno-sanitize=all;-O1"
                                  SKIP_PRECOMPILE_HEADERS ON)  # they are compiled with the sanitizers
    endif()
  endif()
endfunction()

# fathom_cold(<target>): its code runs once or seldom, and takes a quarter to a third less to build without what -O3
# does for loops.
function(fathom_cold target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# fathom_unite(<target> [BY <number>] [BUT <source>…]): eight sources, or so many, are one for the compiler, which takes a
# third to a half of the time, as they share headers. Names of one must not clash with those of others, so tests have a
# namespace each.
function(fathom_unite target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "BY" "BUT")
  if(NOT arg_BY)
    set(arg_BY 8)
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${arg_BY})
  set_source_files_properties(${arg_BUT} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# fathom_unite_parts(<target> <name> <source>…): the same for these sources alone, eight by eight.
function(fathom_unite_parts target name)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  set(place 0)
  foreach(source ${ARGN})
    math(EXPR part "${place} / 8")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${name}_${part}")
    math(EXPR place "${place} + 1")
  endforeach()
endfunction()

# fathom_precompile(<target> <header>…): what most of its sources include, which is a quarter to a third of the time that
# they take to build. Nearly all objects are the same byte for byte. The preset `debug` does without, so that each
# source includes what it uses.
function(fathom_precompile target)
  target_precompile_headers(${target} PRIVATE ${ARGN})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)  # for ccache
    if(CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)  # which warns of its own headers once they are precompiled
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-stringop-overflow;-Wno-array-bounds>)
    endif()
  endif()
endfunction()

# fathom_with_checks(<variable> <source>…): those sources whose code depends on FATHOM_CHECKS, as they make checks of
# src/check or include what makes some; as they are when CMake configures.
function(fathom_with_checks variable)
  set(makes_checks "FATHOM_(ASSERT|VALIDATE)[(]|FATHOM_CHECKS|check::(asserts|validates)")
  foreach(folder src tests)
    file(GLOB_RECURSE names RELATIVE ${PROJECT_SOURCE_DIR}/${folder} ${PROJECT_SOURCE_DIR}/${folder}/*.hpp)
    foreach(name ${names})
      file(READ ${PROJECT_SOURCE_DIR}/${folder}/${name} text_${name})
      list(APPEND headers ${name})
    endforeach()
  endforeach()
  list(REMOVE_ITEM headers check/check.hpp)  # which defines them
  set(wanted "${makes_checks}")
  while(TRUE)
    set(found "")
    foreach(name ${headers})
      if(text_${name} MATCHES "${wanted}")
        list(APPEND found ${name})
      endif()
    endforeach()
    if(NOT found)
      break()
    endif()
    list(REMOVE_ITEM headers ${found})
    foreach(name ${found})
      string(REPLACE "." "[.]" name ${name})
      string(APPEND wanted "|#include \"${name}\"")
    endforeach()
  endwhile()
  set(sources "")
  foreach(source ${ARGN})
    file(READ ${source} text)
    if(text MATCHES "${wanted}")
      list(APPEND sources ${source})
    endif()
  endforeach()
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()
