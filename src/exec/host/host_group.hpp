// A work-group on the host, and what a group kernel may do with one; the other back ends' groups behave alike.
//
// A group kernel is a sequence of sections. A section is a function of an item that runs for all items of the
// group, in any order or at once; when it returns, all items are done and what they wrote to local memory is
// visible to the next section. On the host a section is a plain loop, on a GPU each work-item does its own part
// and waits at a barrier. So items never meet inside a section, and never outside of one:
//
// * What lies between sections (loops, conditions) must go the same way for all items: it depends on the
//   kernel's members, the group's index, or what `broadcast` returned, never on local memory read directly.
// * An item's own values that outlive a section live in a `per_item` array; an item touches only its own.
#pragma once

#include <cstdint>

#include "fathom/math.hpp"

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
  /// A section: section(i) for i = 0 … n−1, which the items share out, i going to item i mod size.
  template <class Section>
  FATHOM_HD void for_each(std::uint32_t n, Section section) const {
    for (std::uint32_t i = 0; i < n; ++i) section(i);
  }
  /// A section that one item runs alone.
  template <class Section>
  FATHOM_HD void once(Section section) const {
    section();
  }
  /// A value of local memory that all items then know; later sections may overwrite it.
  template <class T>
  FATHOM_HD T broadcast(const T& local) const {
    return local;
  }

 private:
  std::uint32_t index_;
};

/// Uninitialised values, one for each item of the group, that survive its barriers (in registers on a GPU).
template <class T, class Group>
FATHOM_HD auto per_item(const Group&) {
  return typename Group::template PerItem<T>();
}

}  // namespace fathom::exec
