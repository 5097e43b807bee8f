// The version of Fathom: of the headers at compile time, and of the library that a program runs with.
#pragma once

#include <fathom/export.hpp>

// Semantic versioning; CHANGELOG.md states the guarantees. CMakeLists.txt reads these lines.
#define FATHOM_VERSION_MAJOR 0
#define FATHOM_VERSION_MINOR 1
#define FATHOM_VERSION_PATCH 0
/// For comparisons: #if FATHOM_VERSION >= 200 is "0.2.0 or later".
#define FATHOM_VERSION (FATHOM_VERSION_MAJOR * 10000 + FATHOM_VERSION_MINOR * 100 + FATHOM_VERSION_PATCH)

namespace fathom {

/// How the library was built, and what it uses on this machine. For bug reports.
struct LibraryInfo {
  int version = 0;             ///< `FATHOM_VERSION` of the library
  const char* text = "";       ///< the same as "major.minor.patch"
  const char* compiler = "";   ///< with its version
  const char* type = "";       ///< CMake's build type
  const char* linkage = "";    ///< "static" or "shared"
  int checks = 0;              ///< compiled-in checks of invariants: 0 none, 1 the cheap ones, 2 all
  const char* simd = "";       ///< the native simulator's vector instructions on this processor, e.g. "AVX-512"
  const char* back_ends = "";  ///< compiled-in back ends of the device simulator: "host", "host cuda", …
};

/// Never throws, and needs no world.
FATHOM_API LibraryInfo library_info();

}  // namespace fathom
