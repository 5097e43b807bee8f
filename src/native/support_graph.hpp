// Which bodies the direct solution of supports holds (dynamics/support.hpp), and in which order.
//
// Sweeps hold light and low structures. Where a contact carries more than they can (`sweep_load`), all bodies that
// press on each other there form a *structure*, and each of its bodies has a *level*: the number of contacts down to
// a non-dynamic body. A body's supports are its contacts with bodies of lower level.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"
#include "native/overloads.hpp"
#include "threads/thread_pool.hpp"
#include "world/archive.hpp"

namespace fathom::native {

class SupportGraph {
 public:
  /// A body of a structure.
  struct Member {
    std::uint32_t slot;
    std::uint32_t structure;                     ///< number that its members share
    std::uint32_t level;                         ///< from 1
    std::uint32_t first_support, support_count;  ///< in `supports`
    std::uint32_t first_load, load_count;        ///< in `loads`
  };
  /// A contact by which a member lies on another, or on a non-dynamic body.
  struct Support {
    std::uint32_t contact;
    std::uint32_t upper;
    std::uint32_t lower;  ///< member, or `none`
    std::uint32_t base;   ///< slot of the non-dynamic body, if `lower` is none
    bool b_is_upper;
  };
  /// Members that press on each other, by level and slot.
  struct Structure {
    std::uint32_t first, end;  ///< of `members`
  };

  SupportGraph(const BodyTable& bodies, const BodyState& state, const ContactGraph& graph, ThreadPool& pool)
      : bodies_(bodies), state_(state), graph_(graph), pool_(pool) {}

  /// Finds structures among the bodies in contact; `stiffness` as for `sweep_load`. Returns true if they have changed.
  bool update(std::span<const std::uint32_t> in_contact, const Overloads& overloads, float stiffness,
              std::uint64_t step);
  /// There are no structures; `update` finds them again.
  void clear();
  bool is_clear() const { return !is_built_ && levels_.empty() && levelled_at_ == 0; }
  /// Levels are found again in the next step.
  void forget_levels() { levelled_at_ = 0; }
  /// Suspends the search for new structures until this step, because all were collapsing.
  void rest_until(std::uint64_t step) { resume_at_ = step; }

  bool empty() const { return members_.empty(); }
  /// Whether the bodies of a contact touch.
  bool touches(std::uint32_t contact) const;
  /// By slot; 0 for bodies that are no members.
  const std::uint16_t* levels() const { return levels_.data(); }
  /// By slot (kg), mass of the heaviest body in the body's overloaded structure; 0 for bodies in none.
  std::span<const float> heaviest() const { return heaviest_; }
  std::span<const Structure> structures() const { return structures_; }
  std::span<const Member> members() const { return members_; }
  std::span<const Support> supports() const { return supports_; }
  /// Supports whose lower body is the member.
  std::span<const std::uint32_t> loads(const Member& m) const { return {loads_.data() + m.first_load, m.load_count}; }
  std::size_t memory_bytes() const;

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.levels_, s.heaviest_, s.levelled_at_, s.resume_at_, s.search_at_);
  }
  /// Levels have been read; the next `update` builds structures from them.
  void restored(ByteReader& in, std::size_t slots);

 private:
  /// A coloured contact. Searches go through these again and again, in order, where contacts themselves are scattered.
  struct Coloured {
    std::uint32_t contact, a, b, manifold;
    bool presses;  ///< it touches and is no hit; known while links are listed
  };

  void clear_structures();
  void clear_levels();
  bool is_base(std::uint32_t slot) const { return !(state_.flags[slot] & awake) || (state_.flags[slot] & kinematic); }
  bool is_member(std::uint32_t slot) const;
  template <class Act>
  void for_each_neighbour(std::uint32_t node, const Act& act) const;
  void number(std::span<const std::uint32_t> in_contact);
  void list_contacts(bool for_links);
  bool presses(const Coloured& c) const;
  std::uint32_t node_of(std::uint32_t slot) const;
  std::uint32_t root(std::uint32_t node);
  void join(std::uint32_t a, std::uint32_t b);
  void list_links();
  void find_levels();
  void add_up_loads(float stiffness);
  void keep_overloaded(const Overloads& overloads);
  void publish_levels();
  void build();
  void list_members();
  void sort_members();
  void list_supports();
  void sort_supports();
  void give_back_search();

  const BodyTable& bodies_;
  const BodyState& state_;
  const ContactGraph& graph_;
  ThreadPool& pool_;
  // By slot, both empty if no body has a level.
  std::vector<std::uint16_t> levels_;  // 0: no member
  std::vector<float> heaviest_;
  std::vector<std::uint32_t> levelled_;  // slots whose entries are not 0
  std::uint64_t levelled_at_ = 0;        // ContactGraph::colouring
  std::uint64_t resume_at_ = 0;          // step
  std::uint64_t search_at_ = 0;          // step, for contacts that have begun
  bool is_built_ = false;
  std::vector<Structure> structures_;
  std::vector<Member> members_;
  std::vector<Support> supports_;
  std::vector<std::uint32_t> loads_;
  /// A body in contact, during one search.
  struct Node {
    std::uint32_t slot;
    std::uint32_t parent;                ///< towards the root of its structure
    std::uint32_t first_link, end_link;  ///< of `links_of_`
    std::uint32_t base_links;            ///< contacts with non-dynamic bodies
    std::uint32_t member;                ///< of `members_`
    float mass, inverse_mass;            ///< kg, 1/kg
    float half_thickness;                ///< m
    float load;                          ///< of the body and all it carries (kg)
    float heaviest;                      ///< of a root (kg), see `heaviest`
    std::uint16_t level;
    bool is_overloaded;  ///< of a root
  };
  /// A touching contact between nodes; `a` is `none` if it is not dynamic.
  struct Link {
    std::uint32_t a, b;
  };
  LargeArray<std::uint32_t> numbers_;  // node numbers by slot; arbitrary for bodies not in contact
  std::vector<Node> nodes_;
  std::vector<Coloured> contacts_;  // in the order of colours' lists
  std::vector<Link> links_;
  std::vector<std::uint32_t> links_of_;  // of each node
  std::vector<std::uint32_t> queue_;     // nodes by level
  std::vector<Support> found_supports_;  // unsorted
  std::vector<Member> unsorted_;
  std::vector<std::uint32_t> places_;  // of members, by level or structure
};

}  // namespace fathom::native
