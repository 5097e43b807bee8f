// A work-group on SYCL. Sections are described in group.hpp.
//
// Barriers and local memory only: AdaptiveCpp's generic target compiles group algorithms, but they fail at run time.
#pragma once

#include <cstdint>
#include <sycl/sycl.hpp>

namespace fathom::exec {

template <std::uint32_t Size>
class SyclGroup {
 public:
  static constexpr std::uint32_t size = Size;

  /// Each work-item keeps its own value.
  template <class T>
  class PerItem {
   public:
    T& operator[](std::uint32_t) { return value_; }

   private:
    T value_;
  };

  SyclGroup(const sycl::nd_item<1>& work_item, std::uint32_t index) : work_item_(work_item), index_(index) {}

  std::uint32_t index() const { return index_; }

  template <class Section>
  void for_each(Section section) const {
    section(item());
    barrier();
  }
  template <class Section>
  void for_each(std::uint32_t n, Section section) const {
    for (std::uint32_t i = item(); i < n; i += Size) section(i);
    barrier();
  }
  template <class Section>
  void once(Section section) const {
    if (item() == 0) section();
    barrier();
  }
  template <class T>
  T broadcast(const T& local) const {
    const T value = local;
    barrier();  // all have read before any may overwrite
    return value;
  }

 private:
  std::uint32_t item() const { return static_cast<std::uint32_t>(work_item_.get_local_linear_id()); }
  void barrier() const { sycl::group_barrier(work_item_.get_group()); }

  sycl::nd_item<1> work_item_;
  std::uint32_t index_;
};

}  // namespace fathom::exec
