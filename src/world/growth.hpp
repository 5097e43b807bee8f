// Arrays that grow by a quarter rather than twofold: memory per body and per manifold is a promise.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

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

/// Gives back the room that a burst needed, as a scene's first step, where `size` is far less. Clears the array.
template <class T>
void give_back_room(std::vector<T>& array, std::size_t size) {
  constexpr std::size_t burst = 1024;
  if (array.capacity() > burst && 8 * size < array.capacity())
    std::vector<T>().swap(array);
  else
    array.clear();
}

}  // namespace fathom
