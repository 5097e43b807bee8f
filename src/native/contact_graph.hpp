// All contacts of a world: their storage, which bodies they hang on, and the colours of those that touch.
//
// Colouring is greedy and persistent (as in Box2D v3 and Box3D): a contact takes the lowest colour free on both of
// its bodies when it begins to touch and keeps it until it ends. Contacts with a body that cannot be pushed
// block only the other body and have colours of their own, solved last because the ground is the firmer side. A
// contact that finds no colour goes to the overflow list, which is solved one by one. Changes are made by one thread in
// the order of contacts, so colours do not depend on timing. Colours are listed by unit (domains.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "native/body_state.hpp"
#include "native/broad_phase.hpp"
#include "native/contact.hpp"
#include "native/domains.hpp"
#include "native/narrow_phase.hpp"
#include "native/pair_set.hpp"
#include "native/solver_kernels.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

class ContactGraph {
 public:
  ContactGraph(BodyTable& bodies, BodyState& state) : bodies_(bodies), state_(state), colours_(overflow_colour + 1) {}

  Contact& operator[](std::uint32_t index) { return contacts_[index]; }
  const Contact& operator[](std::uint32_t index) const { return contacts_[index]; }
  /// Upper end of indices; slots in between may be unused (`Contact::in_use`).
  std::size_t size() const { return contacts_.size(); }
  std::size_t pair_count() const { return pairs_.size(); }
  const PairSet& pairs() const { return pairs_; }
  ContactManifold& manifold(const Contact& contact) { return manifolds_[contact.manifold]; }
  const ContactManifold& manifold(const Contact& contact) const { return manifolds_[contact.manifold]; }
  Constrained constrained() { return {contacts_.data(), manifolds_.data()}; }
  /// True once any contact had a restitution above zero.
  bool may_bounce() const { return may_bounce_; }

  /// Appends the contacts made to `added`, where it is given. Pairs that are there already are left out.
  void add(std::span<const Pair> pairs, std::vector<std::uint32_t>* added = nullptr);
  /// The same for pairs that are all new and no two of them equal, on all threads.
  void add_new(std::span<const Pair> pairs, ThreadPool& pool, std::vector<std::uint32_t>* added = nullptr);
  void remove(std::uint32_t index);
  /// Removes the contacts of all pairs marked `gone`, on all threads; those of them that touch are ended by
  /// end_touch(), by one thread, meanwhile.
  void remove(std::span<const PartedContact> parted, ThreadPool& pool, const std::function<void()>& end_touch);
  /// Makes room for the manifolds of `count` contacts that begin to touch; begin(i, index) gives that of the i-th to
  /// the contact `index`, by any thread. end(index) takes it away again.
  void make_manifolds(std::size_t count);
  void begin(std::size_t i, std::uint32_t index) { contacts_[index].manifold = new_manifolds_[i]; }
  void end(std::uint32_t index);
  /// Any number of threads may do this for different contacts.
  void mix_materials(const Contact& contact);

  /// The memory that ending this contact will need, to be fetched some contacts ahead: first the contact, then what
  /// hangs on it.
  void prefetch(std::uint32_t index) const;
  void prefetch_neighbours(std::uint32_t index, std::uint32_t side) const;
  /// What colouring it will need, once the contact is there.
  void prefetch_bodies(std::uint32_t index) const;

  /// Gives the touching contact a colour, or takes it away. Both may be called only where it is due.
  void colour(std::uint32_t index);
  void uncolour(std::uint32_t index);
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
  /// Contacts between two bodies that can be pushed.
  std::size_t between() const { return between_; }

  const Domains& domains() const { return domains_; }
  /// Divides the bodies `slots` anew and lists all contacts by their domains; no bodies, no domains.
  void divide(std::span<const std::uint32_t> slots, ThreadPool& pool);
  void resize(std::size_t slots) { domains_.resize(slots); }

  /// Changes whenever any colour's list does.
  std::uint64_t colouring() const { return colouring_; }

  /// Calls act(index) for each contact of the body; `act` may remove that contact.
  template <class Act>
  void for_each_of(std::uint32_t slot, const Act& act) const {
    for (std::uint32_t link = state_.first_contact[slot]; link != none;) {
      const std::uint32_t index = link >> 1;
      link = links_[index].next[link & 1];
      act(index);
    }
  }

  std::size_t memory_bytes() const;

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.contacts_, s.links_, s.free_, s.manifolds_, s.free_manifolds_, s.may_bounce_, s.colours_);
  }
  /// Into an empty graph whose bodies are there.
  void restore(ByteReader& in);

 private:
  std::uint32_t add(Pair pair);
  void fill(Contact& c, Pair pair) const;
  /// Calls of_bodies(owns) for every part of all bodies' lists of contacts, owns(slot) telling which these are, and
  /// of_tables(owns) for every part of the set of pairs, owns(table), each by one thread. The caller begins with
  /// alone().
  template <class Alone, class OfBodies, class OfTables>
  void for_each_owner(ThreadPool& pool, const Alone& alone, const OfBodies& of_bodies, const OfTables& of_tables) const;
  std::size_t list_number(const Contact& c) const { return domains_.unit(c) * (overflow_colour + 1) + c.colour; }
  std::vector<std::uint32_t>& list_of(const Contact& c);
  void enlist_all(ThreadPool& pool);
  void enlist(std::uint32_t index);
  /// That the contact is solved from now on, or no more.
  void note_in_bodies(std::uint32_t index);
  void link(std::uint32_t index, std::uint32_t side);
  void unlink(std::uint32_t index, std::uint32_t side);
  static std::uint32_t body(const Contact& c, std::uint32_t side) { return side == 0 ? c.a : c.b; }

  BodyTable& bodies_;
  BodyState& state_;
  LargeArray<Contact> contacts_;
  LargeArray<ContactLinks> links_;  // of each contact
  std::vector<std::uint32_t> free_;
  LargeArray<ContactManifold> manifolds_;
  std::vector<std::uint32_t> free_manifolds_;
  bool may_bounce_ = false;
  PairSet pairs_;
  std::vector<std::uint32_t> new_contacts_;  // of `add_new`
  std::vector<std::uint32_t> new_manifolds_;
  Domains domains_;
  std::vector<std::vector<std::uint32_t>> colours_;  // by unit and colour
  std::vector<std::size_t> unit_sizes_ = {0};
  std::size_t sizes_[overflow_colour + 1] = {};
  std::size_t between_ = 0;
  std::uint64_t colouring_ = 1;
};

}  // namespace fathom::native
