// Large heaps of bodies, divided into domains that threads can work on without waiting for each other.
//
// There are three divisions of the same bodies, with borders at different positions. A contact is solved in the first
// division that has both its bodies in one domain. Domains of one division share no body, so all are solved at once,
// and a sweep is three loops whatever the number of colours. Contacts cut by every division (few, where two borders
// cross) are left to one thread. Non-dynamic bodies belong to no domain: their contacts belong to the other body's.
//
// Unlike colours' blocks, domains affect the order in which contacts are solved. So they are a function of bodies and
// contacts, never of threads, and part of a snapshot.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <fathom/math.hpp>
#include <span>
#include <vector>

#include "native/contact.hpp"
#include "world/archive.hpp"

namespace fathom {

class ThreadPool;

namespace native {

struct BodyState;

/// Units in which contacts are solved: the domains of each division and, last, the contacts cut by every division.
/// Without domains there is one unit.
class Domains {
 public:
  static constexpr std::size_t divisions = 3;

  bool in_use() const { return counts_[0] > 0; }
  std::size_t count(std::size_t division) const { return counts_[division]; }
  std::size_t first_unit(std::size_t division) const { return first_units_[division]; }
  /// The unit of contacts cut by all divisions.
  std::size_t remainder() const { return first_units_[divisions]; }
  std::size_t units() const { return remainder() + 1; }

  std::size_t unit(const Contact& c) const { return unit(c.a, c.b, c.fixed_a); }
  std::size_t unit(std::uint32_t body_a, std::uint32_t body_b, bool fixed_a) const {
    if (!in_use()) return 0;
    const Ids& b = ids_[body_b];
    if (fixed_a) return b[0];
    const Ids& a = ids_[body_a];
    for (std::size_t division = 0; division < divisions; ++division)
      if (a[division] == b[division]) return first_units_[division] + a[division];
    return remainder();
  }
  std::size_t home(std::uint32_t slot) const { return ids_[slot][0]; }

  /// Divides the bodies `slots` again, given all contacts and their colours; `between` of them connect two dynamic
  /// bodies.
  void divide(std::span<const std::uint32_t> slots, std::span<const Contact> contacts, std::size_t between,
              const BodyState& state, ThreadPool& pool);
  void clear();
  /// New bodies belong to the first domains.
  void resize(std::size_t slots) { ids_.resize(slots, Ids{}); }

  std::size_t memory_bytes() const { return ids_.capacity() * sizeof(Ids) + weights_.capacity() * sizeof(float); }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.ids_, s.counts_);
  }
  /// For `slots` bodies.
  void restore(ByteReader& in, std::size_t slots);

 private:
  using Ids = std::array<std::uint8_t, divisions>;
  struct Entry {
    std::uint32_t key, slot;
  };
  struct Grid {
    std::size_t columns = 1, rows = 1;
  };

  /// Slots sorted by a first coordinate and by a second.
  struct Orders {
    std::vector<Entry> by_first, by_second;
  };

  static Grid grid(std::size_t count, float aspect);
  void set_counts(const std::array<std::uint32_t, divisions>& counts);
  void divide(std::size_t division, Grid grid, Grid finest, float offset, const Orders& orders);
  void balance_first(std::span<const Contact> contacts, const Orders& orders, const BodyState& state, ThreadPool& pool);

  std::vector<Ids> ids_;  // by slot
  std::array<std::uint32_t, divisions> counts_{};
  std::array<std::size_t, divisions + 1> first_units_{};
  std::vector<float> weights_;  // by slot, in the division being made
};

}  // namespace native
}  // namespace fathom
