// Written by CMake.
#pragma once

namespace fathom::build_info {

inline constexpr char version[] = "0.1.0";
inline constexpr char commit[] = "e73a50bed7dc";
inline constexpr char compiler[] = "Clang 14.0.6";
inline constexpr char build_type[] = "Release";

}  // namespace fathom::build_info
