// What a kernel may write of a set of arrays: the set is a template over the parts of it that its holder writes. Arrays
// of these parts are pointers, all others pointers to const:
//
//     struct LoadBodies {
//       Bodies<body_colours, body_solver> bodies;   reads all, writes these
//
// A set that allows less comes of one that allows more, with the same bits. Functions that read take any.
#pragma once

#include <type_traits>

namespace fathom::device {

template <auto part, auto... written>
inline constexpr bool is_among = ((part == written) || ...);

/// An array of a set's `part`, for who writes the parts `written`.
template <class T, auto part, auto... written>
using Array = std::conditional_t<is_among<part, written...>, T, const T>*;

}  // namespace fathom::device
