// Arrays that grow by a quarter instead of doubling: Fathom promises an amount of memory per body and per manifold.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "world/large_array.hpp"

namespace fathom {

template <class Array>
void make_room(Array& array, std::size_t size) {
  if (size > array.capacity())
    array.reserve(std::max({size, array.capacity() + array.capacity() / 4, std::size_t{16}}));
}

template <class Array>
void grow_to(Array& array, std::size_t size) {
  make_room(array, size);
  array.resize(size);
}

/// Whether the capacity far exceeds `size`: it was needed only for a burst, such as a scene's first step.
template <class Array>
bool is_of_a_burst(const Array& array, std::size_t size) {
  constexpr std::size_t burst = 1024;
  return array.capacity() > burst && 8 * size < array.capacity();
}

/// Clears the array; frees capacity needed only for a burst.
template <class T>
void give_back_room(std::vector<T>& array, std::size_t size) {
  if (is_of_a_burst(array, size))
    std::vector<T>().swap(array);
  else
    array.clear();
}

/// Resizes to `size` uninitialised elements; reallocates if the capacity was needed only for a burst.
template <class T>
void make_anew(LargeArray<T>& array, std::size_t size) {
  if (is_of_a_burst(array, size)) array.reset();
  array.clear();
  grow_to(array, size);
}

}  // namespace fathom
