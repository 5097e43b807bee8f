// Arrays that grow by a quarter rather than twofold: memory per body and per manifold is a promise.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fathom {

template <class T>
void make_room(std::vector<T>& array, std::size_t size) {
  if (size > array.capacity())
    array.reserve(std::max({size, array.capacity() + array.capacity() / 4, std::size_t{16}}));
}

template <class T>
void grow_to(std::vector<T>& array, std::size_t size) {
  make_room(array, size);
  array.resize(size);
}

}  // namespace fathom
