// Assigns constraints to lanes of blocks, and blocks to threads. This affects only speed: within a colour any order
// gives the same result, and so does any order of islands, or of a division's domains.
//
// Large heaps are divided into units (domains.hpp), each with its own blocks and bodies. Where contacts are few, bodies
// form many islands, which do not affect each other. Nearby islands then form a group, which one thread takes through
// all sweeps without waiting for the others. Otherwise all threads work on one colour after the other. Each thread has
// a share of every colour and its bodies, at nearly the same position in all of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "native/body_state.hpp"
#include "native/contact_graph.hpp"
#include "native/neighbourhood.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

/// Ascending slots, the kinematic ones among them, and a number that changes when they do.
struct BodiesInContact {
  std::span<const std::uint32_t> slots;
  std::uint64_t version;
  std::span<const std::uint32_t> kinematic{};
};

class ConstraintLayout {
 public:
  /// Consecutive blocks of one colour.
  struct Stretch {
    std::size_t first, end;
    std::size_t shares;  ///< threads that share it; 1 in a group
  };
  struct Range {
    std::size_t begin, end;
  };
  /// Ranges of `bodies`, `stretches` and blocks.
  struct Group {
    Range bodies, stretches, blocks;
  };

  /// Ranges of `bodies`, `stretches` and blocks. Only units of the first division have bodies, and contacts with
  /// non-dynamic bodies.
  struct Unit {
    Range bodies{0, 0}, between{0, 0}, on_fixed{0, 0}, blocks{0, 0};
  };

  ConstraintLayout(const BodyState& state, const ContactGraph& graph, ThreadPool& pool, std::size_t width)
      : state_(state), graph_(graph), pool_(pool), width_(width) {}

  /// Whether `update` will use domains; otherwise threads divide the work by neighbourhood.
  bool may_use_domains() const { return graph_.domains().in_use() && !graph_.any_overflow(); }
  /// Follows the graph's colours and the bodies in contact. Returns true if blocks have moved.
  bool update(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood);

  /// Bodies in contact, in the order of their contacts' blocks where possible; with groups or domains, the dynamic
  /// ones.
  std::span<const std::uint32_t> bodies() const { return bodies_; }
  /// The kinematic bodies, which belong to no group or domain.
  std::span<const std::uint32_t> kinematic() const { return kinematic_; }

  /// Constraint of each lane, or `none`. A block's constraints are of one kind.
  const ConstraintRef* lanes() const { return lanes_.data(); }
  std::size_t lane_count() const { return blocks_ * width_; }
  std::size_t width() const { return width_; }
  std::size_t blocks() const { return blocks_; }
  int colours() const { return colours_; }
  std::span<const Stretch> stretches() const { return stretches_; }

  /// By number (`Domains::unit`); empty if there are no domains or they cannot be used.
  std::span<const Unit> units() const { return units_; }
  std::span<const Unit> first_units() const { return units().first(units_.empty() ? 0 : graph_.domains().count(0)); }
  std::span<const std::uint32_t> bodies(const Unit& unit) const {
    return {bodies_.data() + unit.bodies.begin, unit.bodies.end - unit.bodies.begin};
  }
  std::span<const Stretch> stretches(const Range& range) const {
    return {stretches_.data() + range.begin, range.end - range.begin};
  }

  /// Empty if all bodies form one group, shared by all threads.
  std::span<const Group> groups() const { return groups_; }
  std::span<const std::uint32_t> bodies(const Group& group) const {
    return {bodies_.data() + group.bodies.begin, group.bodies.end - group.bodies.begin};
  }
  std::span<const Stretch> stretches(const Group& group) const { return stretches(group.stretches); }

  /// Calls act(begin, end, share_end) for parts of the stretch's blocks, each on the thread whose share, ending at
  /// share_end, contains them.
  template <class Act>
  void for_each_part(std::size_t stretch, const Act& act) {
    const std::size_t* first = cuts(stretch);
    const std::size_t shares = stretches_[stretch].shares;
    pool_.for_each_share(
        shares, [&](std::size_t t) { return first[t]; },
        [&](std::size_t begin, std::size_t end) { act(begin, end, *std::lower_bound(first, first + shares, end)); });
  }
  /// Calls act(begin, end) for parts of the bodies in contact, each on the thread whose share it is.
  template <class Act>
  void for_each_part_of_bodies(const Act& act) {
    pool_.for_each_share(
        body_cuts_.size() - 1, [&](std::size_t t) { return body_cuts_[t]; }, act);
  }
  /// Calls act(begin, end) for blocks of all colours, on the threads that will sweep them.
  template <class Act>
  void for_each_part_of_all(const Act& act);

  std::size_t memory_bytes() const;

 private:
  std::size_t threads() const { return static_cast<std::size_t>(pool_.thread_count()); }
  std::size_t min_blocks() const { return width_ < min_lanes ? min_lanes / width_ : 1; }
  std::size_t* cuts(std::size_t stretch) { return cuts_.data() + stretch * (threads() + 1); }

  void fill_by_colour(const Neighbourhood& neighbourhood);
  void order_bodies(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood);
  void share_out();
  void share_out_bodies(const Neighbourhood& neighbourhood);

  std::span<const std::uint32_t> without_kinematic(const BodiesInContact& in_contact);
  /// Recolours the unit's contacts between bodies, into `recoloured_`. False if that is not worthwhile.
  bool recolour(std::size_t unit);
  void fill_by_unit();
  std::vector<std::uint32_t>::iterator first_lane(const Stretch& stretch) {
    return lanes_.begin() + static_cast<std::ptrdiff_t>(stretch.first * width_);
  }
  void list_bodies_by_unit(std::span<const std::uint32_t> in_contact);

  bool may_group(std::span<const std::uint32_t> in_contact) const;
  void join_islands();
  bool form_groups(std::span<const std::uint32_t> in_contact);
  void list_bodies(std::span<const std::uint32_t> in_contact);
  void fill_by_group();
  std::uint32_t root(std::uint32_t slot);

  static constexpr std::size_t min_lanes = 32;  // smallest work worth another thread, about half a microsecond
  static constexpr std::size_t min_bodies = 64;

  const BodyState& state_;
  const ContactGraph& graph_;
  ThreadPool& pool_;
  const std::size_t width_;

  std::uint64_t colouring_ = 0, version_ = 0;  // versions that blocks and bodies are built for
  std::size_t threads_ = 0;                    // number of threads they are divided for
  std::vector<std::uint32_t> bodies_, dynamic_;
  std::span<const std::uint32_t> kinematic_;
  std::vector<ConstraintRef> lanes_;
  std::size_t blocks_ = 0;
  int colours_ = 0;
  std::vector<Stretch> stretches_;

  // Shared by all threads: where each thread's blocks of a stretch, its bodies and its regions begin.
  std::vector<int> colour_of_;                   // by stretch
  std::vector<Neighbourhood::Offsets> offsets_;  // of each stretch's lanes
  std::vector<std::size_t> cuts_, body_cuts_, region_cuts_;

  // In domains.
  std::vector<Unit> units_;
  std::vector<const std::vector<std::uint32_t>*> lists_;  // by stretch; null where its lanes are filled
  std::array<std::vector<std::uint32_t>, first_fixed_colour> recoloured_;
  std::vector<std::uint32_t> own_colours_;  // by slot, of the unit being coloured
  std::vector<std::uint32_t> next_body_;    // by chunk and unit

  // In groups.
  struct Island {  // of a body; all but `parent` valid for the root only
    std::uint32_t parent, weight, group;
  };
  struct Link {  // `root` is body A until islands are joined
    ConstraintRef constraint;
    std::uint32_t colour, b, root;
  };
  std::vector<Group> groups_;
  std::vector<Island> island_;                // by slot
  std::vector<std::uint32_t> group_of_body_;  // by index in `in_contact`
  std::vector<Link> links_;
  std::vector<std::uint32_t> next_lane_;  // by group and colour
};

template <class Act>
void ConstraintLayout::for_each_part_of_all(const Act& act) {
  constexpr std::size_t parts = ThreadPool::parts_a_thread;
  const std::size_t shares = parts * threads();
  if (blocks_ < shares * min_blocks()) return pool_.for_each_part(blocks_, min_blocks(), act);
  pool_.for_each_part(shares, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = 0; s < stretches_.size(); ++s)
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t first = cuts(s)[i / parts], size = cuts(s)[i / parts + 1] - first;
        act(first + i % parts * size / parts, first + (i % parts + 1) * size / parts);
      }
  });
}

}  // namespace fathom::native
