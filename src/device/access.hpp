// Which arrays of a set a kernel may write: the set is a template over the parts that its holder writes. Arrays of
// these parts are pointers, all others pointers to const:
//
//     struct LoadBodies {
//       Bodies<body_colours, body_solver> bodies;   reads all, writes these
//
// A set converts to one that allows less, with the same bits. Functions that only read take any.
#pragma once

#include <type_traits>

namespace fathom::device {

template <auto part, auto... written>
inline constexpr bool is_among = ((part == written) || ...);

/// An array of a set's `part`, for a holder that writes the parts `written`.
template <class T, auto part, auto... written>
using Array = std::conditional_t<is_among<part, written...>, T, const T>*;

}  // namespace fathom::device
