// Arrays that grow by a quarter rather than twofold: memory per body and per manifold is a promise.
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

/// True of the room that a burst needed, as a scene's first step, where `size` is far less.
template <class Array>
bool is_of_a_burst(const Array& array, std::size_t size) {
  constexpr std::size_t burst = 1024;
  return array.capacity() > burst && 8 * size < array.capacity();
}

/// Gives back the room that a burst needed. Clears the array.
template <class T>
void give_back_room(std::vector<T>& array, std::size_t size) {
  if (is_of_a_burst(array, size))
    std::vector<T>().swap(array);
  else
    array.clear();
}

/// Makes the array anew with `size` elements that hold anything, in the room there is or in room of its own size.
template <class T>
void make_anew(LargeArray<T>& array, std::size_t size) {
  if (is_of_a_burst(array, size)) array.reset();
  array.clear();
  grow_to(array, size);
}

}  // namespace fathom
