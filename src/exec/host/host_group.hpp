// A work-group on the host; the other back ends' groups behave the same.
#pragma once

#include <cstdint>

#include "exec/group.hpp"

namespace fathom::exec {

template <std::uint32_t Size>
class HostGroup {
 public:
  static constexpr std::uint32_t size = Size;

  template <class T>
  class PerItem {
   public:
    FATHOM_HD T& operator[](std::uint32_t item) { return values_[item]; }

   private:
    T values_[Size];
  };

  FATHOM_HD explicit HostGroup(std::uint32_t index) : index_(index) {}

  FATHOM_HD std::uint32_t index() const { return index_; }

  /// A section: section(item) for each item of the group.
  template <class Section>
  FATHOM_HD void for_each(Section section) const {
    for (std::uint32_t item = 0; item < Size; ++item) section(item);
  }
  /// A section: section(i) for i = 0 … n−1, distributed over the items: item i mod size runs i.
  template <class Section>
  FATHOM_HD void for_each(std::uint32_t n, Section section) const {
    for (std::uint32_t i = 0; i < n; ++i) section(i);
  }
  /// A section that one item runs alone.
  template <class Section>
  FATHOM_HD void once(Section section) const {
    section();
  }
  /// Broadcasts a value of local memory to all items; later sections may overwrite it.
  template <class T>
  FATHOM_HD T broadcast(const T& local) const {
    return local;
  }

 private:
  std::uint32_t index_;
};

}  // namespace fathom::exec
