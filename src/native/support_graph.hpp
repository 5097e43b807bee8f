// Which bodies are held by the direct solution of supports (dynamics/support.hpp), and in which order.
//
// Sweeps hold what is light and low. Where a contact carries more than they can (`sweep_load`), all bodies that press
// on each other there make a *structure*, and each of its bodies has a *level*: the number of contacts down to
// something that cannot be pushed. A body's supports are its contacts with bodies of lower level.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"
#include "native/overloads.hpp"
#include "world/archive.hpp"

namespace fathom::native {

class SupportGraph {
 public:
  /// A body of a structure.
  struct Member {
    std::uint32_t slot;
    std::uint32_t structure;
    std::uint32_t level;                         ///< from 1
    std::uint32_t first_support, support_count;  ///< in `supports`
    std::uint32_t first_load, load_count;        ///< in `loads`
  };
  /// A contact through which a member rests on another, or on something that cannot be pushed.
  struct Support {
    std::uint32_t contact;
    std::uint32_t upper;
    std::uint32_t lower;  ///< member, or `none`
    std::uint32_t base;   ///< slot of what cannot be pushed, where `lower` is none
    bool b_is_upper;
  };
  /// Members that press on each other, by level and slot.
  struct Structure {
    std::uint32_t first, end;  ///< of `members`
  };

  SupportGraph(const BodyTable& bodies, const BodyState& state, const ContactGraph& graph)
      : bodies_(bodies), state_(state), graph_(graph) {}

  /// Finds structures among the bodies in contact, with `stiffness` as `sweep_load` has it. Returns true where they are
  /// other than before.
  bool update(std::span<const std::uint32_t> in_contact, const Overloads& overloads, float stiffness,
              std::uint64_t step);
  /// Levels are found anew in the next step.
  void forget_levels() { levelled_at_ = 0; }
  /// Structures are not looked for before this step, but for those there are: all were coming down.
  void rest_until(std::uint64_t step) { resume_at_ = step; }

  bool empty() const { return members_.empty(); }
  /// By slot; 0 where a body is no member.
  const std::uint16_t* levels() const { return levels_.data(); }
  /// By slot (kg), of the heaviest body of the overloaded structure that a body is in; 0 where it is in none.
  std::span<const float> heaviest() const { return heaviest_; }
  std::span<const Structure> structures() const { return structures_; }
  std::span<const Member> members() const { return members_; }
  std::span<const Support> supports() const { return supports_; }
  /// Supports that a member is the lower body of.
  std::span<const std::uint32_t> loads(const Member& m) const { return {loads_.data() + m.first_load, m.load_count}; }
  std::size_t memory_bytes() const;

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.levels_, s.heaviest_, s.levelled_at_, s.resume_at_, s.search_at_);
  }
  /// Levels are as they were; structures are made of them by the next `update`.
  void restored(ByteReader& in, std::size_t slots) {
    in.require(levels_.size() <= slots && heaviest_.size() <= slots);
    is_built_ = false;
  }

 private:
  void clear_structures();
  bool is_base(std::uint32_t slot) const { return !(state_.flags[slot] & awake) || (state_.flags[slot] & kinematic); }
  template <class Act>
  void for_each_contact(const Act& act) const;
  std::uint32_t root(std::uint32_t slot);
  void list_links(std::span<const std::uint32_t> in_contact);
  void find_levels();
  void add_up_loads(float stiffness);
  void find_heaviest();
  void keep_overloaded(std::span<const std::uint32_t> in_contact, const Overloads& overloads);
  void build(std::span<const std::uint32_t> in_contact);
  void give_back_search();
  void list_supports();

  const BodyTable& bodies_;
  const BodyState& state_;
  const ContactGraph& graph_;
  std::vector<std::uint16_t> levels_;  // by slot; 0: no member
  std::vector<float> heaviest_;        // by slot
  std::uint64_t levelled_at_ = 0;      // ContactGraph::colouring
  std::uint64_t resume_at_ = 0;        // step
  std::uint64_t search_at_ = 0;        // step, for contacts that have begun
  bool is_built_ = false;
  std::vector<Structure> structures_;
  std::vector<Member> members_;
  std::vector<Support> supports_;
  std::vector<std::uint32_t> loads_;
  std::vector<std::uint32_t> member_of_;  // by slot
  // Of one search.
  struct Link {  // a contact that touches; where A cannot be pushed, `fixed`
    std::uint32_t contact, a, b;
    bool fixed;
  };
  std::vector<Link> links_;
  std::vector<std::uint32_t> parent_;                 // by slot
  std::vector<std::uint8_t> is_overloaded_;           // by slot, of roots
  std::vector<float> load_;                           // by slot (kg), of the body and all that it carries
  std::vector<std::uint32_t> first_link_, links_of_;  // of each body
  std::vector<std::uint32_t> base_links_;             // by slot, contacts with what cannot be pushed
  std::vector<std::uint32_t> queue_;                  // bodies by level
};

}  // namespace fathom::native
