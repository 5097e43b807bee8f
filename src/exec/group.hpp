// What a group kernel may do with its work-group.
//
// A group kernel is a sequence of sections. A section is a function of an item that runs for all items of the group, in
// any order or concurrently; when it returns, all items are done and their writes to local memory are visible to the
// next section. On the host a section is a plain loop; on a GPU each work-item does its own part and waits at a
// barrier. Items therefore never synchronise inside a section, and do not exist outside of one:
//
// * Control flow between sections (loops, conditions) must be the same for all items: it may depend on the
//   kernel's members, the group's index, or what `broadcast` returned, never on local memory read directly.
// * An item's own values that outlive a section live in a `per_item` array; an item touches only its own.
#pragma once

#include "fathom/math.hpp"

namespace fathom::exec {

/// Uninitialised values, one for each item of the group, that survive its barriers (in registers on a GPU).
template <class T, class Group>
FATHOM_HD auto per_item(const Group&) {
  return typename Group::template PerItem<T>();
}

}  // namespace fathom::exec
