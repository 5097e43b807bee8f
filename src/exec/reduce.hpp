// Reduction of any type by any associative operation, written with group kernels, the same for every back end.
//
// The order of the sum depends only on the number of items. Even a sum of floats thus has the same bits on every back
// end and in every run, and minima and maxima need no library.
#pragma once

#include <cstdint>

#include "exec/device.hpp"
#include "exec/group.hpp"

namespace fathom::exec {

struct Add {
  FATHOM_HD auto operator()(auto a, auto b) const { return a + b; }
};
struct Min {
  FATHOM_HD auto operator()(auto a, auto b) const { return b < a ? b : a; }
};
struct Max {
  FATHOM_HD auto operator()(auto a, auto b) const { return a < b ? b : a; }
};

/// Item i of an array, for reductions of data in memory.
template <class T>
struct LoadFrom {
  const T* items;
  FATHOM_HD T operator()(std::uint32_t i) const { return items[i]; }
};

namespace detail {

inline constexpr std::uint32_t reduce_group_size = 256;
inline constexpr std::uint32_t reduce_max_groups = 256;

/// Number of work-groups for n items: another group is worthwhile only if each has at least 8 rounds.
FATHOM_HD std::uint32_t reduce_groups(std::uint32_t n) {
  const std::uint32_t groups = n / (8 * reduce_group_size) + 1;
  return groups < reduce_max_groups ? groups : reduce_max_groups;
}

/// Each group reduces its items to one result: first each work-item on its own, then pairwise by halves.
template <class T, class Load, class Op>
struct ReduceGroups {
  static constexpr std::uint32_t group_size = reduce_group_size;
  struct Local {
    LocalArray<T, group_size> result;
  };

  Range range;
  Load load;
  Op op;
  T identity;
  T* results;  // one for each group

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t n = range.size();
    const std::uint32_t groups = reduce_groups(n);
    if (group.index() >= groups) return;
    group.for_each([&](std::uint32_t item) {
      T result = identity;
      for (std::uint32_t i = group.index() * group_size + item; i < n; i += groups * group_size) {
        result = op(result, load(i));
      }
      local.result[item] = result;
    });
    for (std::uint32_t half = group_size / 2; half > 0; half /= 2) {
      group.for_each(
          half, [&](std::uint32_t item) { local.result[item] = op(local.result[item], local.result[item + half]); });
    }
    group.once([&] { results[group.index()] = local.result[0]; });
  }
};

/// First-round results; unused groups count as identity.
template <class T, class Op>
struct LoadGroupResult {
  const T* results;
  Range range;
  T identity;
  FATHOM_HD T operator()(std::uint32_t i) const { return i < reduce_groups(range.size()) ? results[i] : identity; }
};

}  // namespace detail

template <class T>
std::size_t reduce_scratch_bytes() {
  return detail::reduce_max_groups * sizeof(T);
}

/// *out = identity ∘ load(0) ∘ load(1) ∘ … for all items of the range; `out` is in device memory.
template <Device D, class T, class Load, class Op>
void reduce(D& device, Scratch& scratch, Range range, Load load, Op op, T identity, T* out,
            Where where = Where::current()) {
  T* const results = reinterpret_cast<T*>(scratch.take(reduce_scratch_bytes<T>(), where));
  const std::uint32_t groups = detail::reduce_groups(range.capacity);
  using First = detail::ReduceGroups<T, Load, Op>;
  using Second = detail::ReduceGroups<T, detail::LoadGroupResult<T, Op>, Op>;
  device.parallel_groups(groups, First{range, load, op, identity, results}, where);
  device.parallel_groups(1, Second{groups, {results, range, identity}, op, identity, out}, where);
}

}  // namespace fathom::exec
