// All contacts of a world: their storage, their bodies, and the colours of those that touch.
//
// Colouring is greedy and persistent (as in Box2D v3 and Box3D): when a contact begins to touch, it takes the lowest
// colour free on both bodies and keeps it until the touch ends. A contact with a non-dynamic body occupies a colour of
// the other body only. Such contacts have colours of their own, solved last because the ground is the firmer side. A
// contact that finds no colour goes to the overflow list, which is solved one by one. One thread assigns and releases
// colours, for touches that begin in a step in the order of their bodies, so they depend neither on timing nor on what
// happens elsewhere. Colours are listed by unit (domains.hpp).
//
// All threads apply a step's changes (apply_changes.cpp): each does all the work for some contacts, some tables of
// pairs or some lists of colours, in the order of contacts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/body_contacts.hpp"
#include "native/body_state.hpp"
#include "native/broad_phase.hpp"
#include "native/contact.hpp"
#include "native/domains.hpp"
#include "native/joint.hpp"
#include "native/narrow_phase.hpp"
#include "native/pair_set.hpp"
#include "native/prefetch.hpp"
#include "native/solver_kernels.hpp"
#include "native/tuning.hpp"
#include "threads/thread_pool.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

/// A touching contact, and where it is solved.
struct GraphEdge {
  std::uint32_t contact, a, b;
  std::uint16_t unit;
  std::uint8_t colour;
  bool fixed_a;

  /// Calls act(slot) for the dynamic bodies.
  template <class Act>
  void for_each_body(const Act& act) const {
    act(b);
    if (!fixed_a) act(a);
  }
};

/// Number of parts into which work on this many contacts or pairs is divided.
inline std::size_t parts_for(const ThreadPool& pool, std::size_t items) {
  return items < min_to_share ? 1 : static_cast<std::size_t>(pool.thread_count());
}

/// Calls act(part) for each part, each on one thread.
template <class Act>
void for_each_part(ThreadPool& pool, std::size_t parts, const Act& act) {
  pool.for_each_part(parts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) act(part);
  });
}

class ContactGraph {
 public:
  ContactGraph(BodyTable& bodies, BodyState& state) : bodies_(bodies), state_(state), colours_(overflow_colour + 1) {}

  Contact& operator[](std::uint32_t index) { return contacts_[index]; }
  const Contact& operator[](std::uint32_t index) const { return contacts_[index]; }
  /// Upper bound of indices; slots in between may be unused (`Contact::in_use`).
  std::size_t size() const { return contacts_.size(); }
  std::size_t pair_count() const { return contacts_.size() - free_.size(); }
  const PairSet& pairs() const { return pairs_; }
  ContactManifold& manifold(const Contact& contact) { return manifolds_[contact.manifold]; }
  const ContactManifold& manifold(const Contact& contact) const { return manifolds_[contact.manifold]; }
  Constrained constrained() {
    return {contacts_.data(),
            manifolds_.data(),
            joints_.data(),
            joint_impulses_.data(),
            generic_joints_.data(),
            generic_impulses_.data(),
            this};
  }
  TouchChanges& touch_changes() { return touch_changes_; }
  void make_room_for_touches() { touch_changes_.make_room(contacts_.size()); }
  /// True once any contact had a restitution above zero.
  bool may_bounce() const { return may_bounce_; }
  /// True once any contact had a rolling resistance.
  bool may_roll() const { return may_roll_; }
  /// True once any contact had a moving surface.
  bool any_moving_surface() const { return any_moving_surface_; }
  /// True once any contact had a friction that depends on direction.
  bool any_by_direction() const { return any_by_direction_; }
  /// What moving surfaces add to the sliding velocity of B relative to A (m/s, world axes), at the start of the step.
  Vec3 surface_slide(std::uint32_t index) const;
  /// The friction of a contact `by_direction` with this normal (world axes), at the start of the step.
  FrictionEllipse friction_ellipse(std::uint32_t index, Vec3 normal) const;
  /// The materials of two bodies' pieces, combined for their contact.
  ContactMaterials mixed_materials(std::uint32_t a, std::uint32_t b, Children children) const;
  /// Sets a touching contact's materials until they are mixed again. For one thread only.
  void give(std::uint32_t index, const ContactMaterials& materials);
  /// Drops the application's slides of contacts that no longer have one.
  void drop_old_slides();

  /// Appends the new contacts to `added`, if given. Known pairs are skipped.
  void add(std::span<const Pair> pairs, std::vector<std::uint32_t>* added = nullptr);
  /// The same for pairs that are all new and distinct, on all threads.
  void add_new(std::span<const Pair> pairs, ThreadPool& pool, std::vector<std::uint32_t>* added = nullptr);
  void remove(std::uint32_t index);

  // A surface or compound may touch another body in several parts, each a contact of its own: a ring that begins with
  // the pair's first contact.

  /// Adds a contact without a manifold to the pair's ring.
  std::uint32_t add_part(std::uint32_t first, Children children);
  /// The next contact in the ring of its pair; itself if it is alone.
  std::uint32_t next_part(std::uint32_t index) const { return parts_.empty() ? index : parts_[index].next; }
  /// The children that touch in the contact.
  Children children(std::uint32_t index) const {
    return contacts_[index].in_parts ? parts_[index].children : Children{};
  }
  /// For a contact that does not touch.
  void set_children(std::uint32_t index, Children children) { parts_[index].children = children; }
  /// Whether any pair was ever in parts.
  bool any_parts() const { return !parts_.empty(); }
  /// Whether most contacts belong to pairs in parts.
  bool is_mostly_parts() const;
  /// The pair's first contact.
  std::uint32_t first_part(std::uint32_t index) const {
    while (contacts_[index].is_part) index = next_part(index);
    return index;
  }
  template <class Act>
  void for_each_in_ring(std::uint32_t first, const Act& act) const {
    std::uint32_t index = first;
    do {
      const std::uint32_t next = next_part(index);
      act(index);
      index = next;
    } while (index != first);
  }

  // Joints, by their slots in the JointTable (graph_joints.cpp). They change only between steps, and take colours from
  // the same masks as contacts.

  void add_joint(std::uint32_t slot, const Joint& joint);
  /// Defines what the rows of an added or restored generic joint read.
  void define_joint(std::uint32_t slot, const GenericJoint& joint);
  void remove_joint(std::uint32_t slot);
  std::size_t joint_slots() const { return joints_.size(); }
  const Joint& joint(std::uint32_t slot) const { return joints_[slot]; }
  /// Changes all but the bodies, kind and colour.
  void change_joint(std::uint32_t slot, const Joint& changed) {
    Joint& joint = joints_[slot];
    joint_definitions_ += joint.rigid != changed.rigid;
    joint.anchor_a = changed.anchor_a, joint.anchor_b = changed.anchor_b;
    joint.softness = changed.softness, joint.max_impulse = changed.max_impulse;
    joint.max_start = changed.max_start, joint.rigid = changed.rigid;
  }
  const JointImpulse& joint_impulse(std::uint32_t slot) const { return joint_impulses_[slot]; }
  const GenericJoint& generic_joint(std::uint32_t slot) const { return generic_joints_[slot]; }
  /// Changes whenever mechanisms must be found again: a joint becomes rigid or soft, or an axis starts or stops being
  /// locked, limited, driven or armed.
  std::uint64_t joint_definitions() const { return joint_definitions_; }
  bool is_driven(std::uint32_t slot) const {
    return joints_[slot].kind == ConstraintKind::generic_joint && generic_joints_[slot].is_driven();
  }
  const GenericImpulse& generic_impulse(std::uint32_t slot) const { return generic_impulses_[slot]; }
  void forget_joint_impulse(std::uint32_t slot) {
    joint_impulses_[slot] = {};
    if (slot < generic_impulses_.size()) generic_impulses_[slot] = {};
  }
  /// Gives the joint a colour, or releases it, if due.
  void colour_joint(std::uint32_t slot);
  void uncolour_joint(std::uint32_t slot);
  /// Ascending slots; may be empty.
  std::span<const std::uint32_t> joints_of(ConstraintKind kind, std::size_t unit, int colour) const {
    const std::size_t list = joint_list_number(kind, unit, static_cast<std::size_t>(colour));
    return list < joint_lists_.size() ? std::span<const std::uint32_t>(joint_lists_[list])
                                      : std::span<const std::uint32_t>();
  }
  bool any_overflow() const { return sizes_[overflow_colour] + joints_of_colour(overflow_colour) > 0; }
  std::size_t joints_of_colour(int colour) const {
    return joints_of_colour(ConstraintKind::ball_joint, colour) +
           joints_of_colour(ConstraintKind::generic_joint, colour) + joints_of_colour(ConstraintKind::coupling, colour);
  }
  std::size_t joints_of_colour(ConstraintKind kind, int colour) const {
    return joint_counts_[colour][kind_index(kind)];
  }
  /// Coloured joints: those of awake bodies.
  std::size_t coloured_joints() const {
    std::size_t sum = 0;
    for (int colour = 0; colour <= overflow_colour; ++colour) sum += joints_of_colour(colour);
    return sum;
  }
  bool any_generic_joints() const { return !generic_joints_.empty(); }
  /// Calls act(joint) for each coloured joint.
  template <class Act>
  void for_each_coloured_joint(const Act& act) const {
    for (const std::vector<std::uint32_t>& list : joint_lists_)
      for (const std::uint32_t slot : list) act(joints_[slot]);
  }
  /// The two bodies make no contacts until `keep_apart_no_more`.
  void keep_apart(std::uint32_t a, std::uint32_t b) {
    if (!pairs_.contains(a, b)) pairs_.insert(a, b);
  }
  void keep_apart_no_more(std::uint32_t a, std::uint32_t b) { pairs_.erase(a, b); }

  // All changes of a step. Threads may call these at once for different contacts or parts.

  /// Makes room for contacts that end touch and contacts that are removed.
  void expect(std::size_t ended, std::size_t gone);
  /// The i-th of them ends touch; its bodies and lists still have its colour.
  GraphEdge end(std::size_t i, std::uint32_t index);
  /// The i-th of them is removed and no longer touches; its pair is still known.
  Pair leave(std::size_t i, std::uint32_t index);
  /// Forgets this part of the pairs.
  void forget(std::span<const Pair> pairs, std::size_t part, std::size_t parts);
  /// Makes `count` manifolds for contacts that begin to touch. The i-th is in slot new_manifold(i); begin(i, index)
  /// gives it to the contact.
  void make_manifolds(std::size_t count);
  std::uint32_t new_manifold(std::size_t i) const { return new_manifolds_[i]; }
  void begin(std::size_t i, std::uint32_t index) { contacts_[index].manifold = new_manifolds_[i]; }
  ContactManifold& manifold_at(std::uint32_t slot) { return manifolds_[slot]; }
  const ContactManifold& manifold_at(std::uint32_t slot) const { return manifolds_[slot]; }
  void mix_materials(Contact& contact, ContactManifold& manifold);
  void mix_materials(Contact& contact);
  /// Updates this part of the colours' lists by contacts that ended and contacts that have their colours.
  void relist(std::span<const GraphEdge> ended, std::span<const GraphEdge> begun, std::size_t part, std::size_t parts);

  void prefetch(std::uint32_t index) const { prefetch_to_write(&contacts_[index]); }

  // For one thread only.

  /// Gives the contacts colours in this order, or releases them, everywhere but in lists. Skips ended ones without a
  /// colour.
  void colour(std::span<GraphEdge> edges, std::span<const std::uint32_t> order);
  void uncolour(std::span<const GraphEdge> edges);
  /// Gives the touching contact a colour, or releases it. Call each only when due.
  void colour(std::uint32_t index);
  void uncolour(std::uint32_t index);
  GraphEdge edge_of(std::uint32_t index) const;
  const std::vector<std::uint32_t>& of(std::size_t unit, int colour) const {
    return colours_[unit * (overflow_colour + 1) + static_cast<std::size_t>(colour)];
  }
  std::size_t size_of(int colour) const { return sizes_[colour]; }
  std::size_t size_of_unit(std::size_t unit) const { return unit_sizes_[unit]; }
  template <class Act>
  void for_each_of_colour(int colour, const Act& act) const {
    for (std::size_t unit = 0; unit < domains_.units(); ++unit)
      for (const std::uint32_t index : of(unit, colour)) act(index);
  }
  /// Constraints between two dynamic bodies.
  std::size_t between() const { return between_; }

  const Domains& domains() const { return domains_; }
  /// Divides the bodies `slots` into domains and lists all contacts by domain; without bodies there are no domains.
  void divide(std::span<const std::uint32_t> slots, ThreadPool& pool);
  void resize(std::size_t slots) { domains_.resize(slots); }

  /// A body has become an obstacle, or ceased to be one.
  void note_obstacle() { ++colouring_; }
  /// Changes with every list of a colour, and with obstacles.
  std::uint64_t colouring() const { return colouring_; }

  /// Calls act(index) for each contact of the body, the newest first; `act` may remove that contact.
  template <class Act>
  void for_each_of(std::uint32_t slot, const Act& act) {
    for (const std::uint32_t index : body_contacts_.of(slot, contacts_, state_.size())) act(index);
  }

  std::size_t memory_bytes() const;

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.contacts_, s.contacts_made_, s.free_, s.manifolds_, s.free_manifolds_, s.may_bounce_, s.may_roll_,
      s.any_moving_surface_, s.any_by_direction_, s.own_slides_, s.colours_, s.colouring_, s.joints_, s.joint_impulses_,
      s.generic_impulses_, s.parts_);
  }
  /// Into an empty graph whose bodies exist already.
  void restore(ByteReader& in);

 private:
  void grow_contacts(std::size_t count);
  std::uint32_t take_slot();
  void begin_ring(std::uint32_t index, Children children = {});
  void check_ring(ByteReader& in, std::uint32_t index) const;
  void fill(Contact& c, Pair pair, std::uint64_t born) const;
  template <class Act>
  void for_each_in_tables(std::span<const Pair> pairs, std::size_t part, std::size_t parts, const Act& act) const;
  std::size_t list_number(const Contact& c) const { return domains_.unit(c) * (overflow_colour + 1) + c.colour; }
  std::vector<std::uint32_t>& list_of(const GraphEdge& edge);
  void enlist_all(ThreadPool& pool);
  void enlist(const GraphEdge& edge);
  void prefetch_bodies(const GraphEdge& edge) const;
  void count(const GraphEdge& edge, int more);
  std::uint8_t take_colour(std::uint32_t a, std::uint32_t b, bool fixed_a);
  void give_back_colour(std::uint32_t a, std::uint32_t b, bool fixed_a, std::uint8_t colour);
  static constexpr std::size_t joint_kinds = constraint_kinds - 1;
  static std::size_t kind_index(ConstraintKind kind) { return static_cast<std::size_t>(kind) - 1; }
  static std::size_t joint_list_number(ConstraintKind kind, std::size_t unit, std::size_t colour) {
    return (unit * (overflow_colour + 1) + colour) * joint_kinds + kind_index(kind);
  }
  std::vector<std::uint32_t>& joint_list(const Joint& joint);
  void list_joints();

  BodyTable& bodies_;
  BodyState& state_;
  LargeArray<Contact> contacts_;
  LargeArray<std::uint32_t> list_positions_;  // index of each contact in its colour's list
  struct PartLink {
    std::uint32_t next = none;  ///< in the ring
    Children children;
  };
  LargeArray<PartLink> parts_;  // by contact; empty until a pair is in parts
  std::uint64_t contacts_made_ = 0;
  BodyContacts body_contacts_;
  std::vector<std::uint32_t> free_;
  LargeArray<ContactManifold> manifolds_;
  std::vector<std::uint32_t> free_manifolds_;
  TouchChanges touch_changes_;
  bool may_bounce_ = false, may_roll_ = false, any_moving_surface_ = false, any_by_direction_ = false;
  struct OwnSlide {
    std::uint32_t contact = none;
    Vec3 slide;
  };
  std::vector<OwnSlide> own_slides_;  // ascending; entries of contacts without `own_slide` are stale
  PairSet pairs_;
  std::vector<std::uint32_t> new_manifolds_;
  std::size_t first_ended_ = 0, first_gone_ = 0;  // of those expected, in the free lists
  Domains domains_;
  std::vector<std::vector<std::uint32_t>> colours_;  // by unit and colour
  std::size_t colours_room_ = 0;                     // total capacity of these lists, in contacts
  std::vector<std::size_t> unit_sizes_ = {0};
  std::size_t sizes_[overflow_colour + 1] = {};
  std::vector<Joint> joints_;                 // by slot
  std::vector<JointImpulse> joint_impulses_;  // by slot
  std::vector<GenericJoint> generic_joints_;  // by slot, empty until there are any; so are their impulses
  std::vector<GenericImpulse> generic_impulses_;
  std::vector<std::vector<std::uint32_t>> joint_lists_;  // by unit, colour and kind
  std::size_t joint_counts_[overflow_colour + 1][joint_kinds] = {};
  std::size_t between_ = 0;
  std::uint64_t colouring_ = 1, joint_definitions_ = 1;
};

}  // namespace fathom::native
