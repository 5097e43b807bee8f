// Which contacts make columns (dynamics/columns.hpp), and where the solver keeps them.
//
// A column begins with a body that has one contact, its top, and goes on through bodies that have two, to one that
// cannot be pushed or has one contact; it ends before a body with three or more. Columns share no body that can be
// pushed and may therefore be braced at once. Rows that are held at both ends, as arches are, are none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

class Columns {
 public:
  struct Column {
    std::uint32_t lane;             ///< of its first contact
    std::uint32_t first, contacts;  ///< in the list of all
  };

  Columns(const BodyTable& bodies, const BodyState& state, const ContactGraph& graph)
      : bodies_(bodies), state_(state), graph_(graph) {}

  /// Finds them among the bodies `in_contact`. `lanes`: contact of each lane, or `none`.
  void update(std::span<const std::uint32_t> in_contact, std::span<const std::uint32_t> lanes, ThreadPool& pool);

  /// Looks which of them are to be braced in this step.
  void choose();

  /// Those to be braced, in the order of lanes.
  std::span<const Column> all() const { return calm_; }
  /// Of these, those whose contacts are in lanes [begin, end).
  std::span<const Column> within(std::size_t begin, std::size_t end) const;
  const ColumnContact* contacts(const Column& c) const { return contacts_.data() + c.first; }
  std::size_t memory_bytes() const;

 private:
  int contacts_of(std::uint32_t slot) const;
  /// Columns of some of the tops; `first` counts from their own list's beginning.
  struct Found {
    std::vector<Column> columns;
    std::vector<ColumnContact> contacts;
  };
  void find(std::span<const std::uint32_t> tops, Found& found) const;
  void follow_from(std::uint32_t top, Found& found) const;
  bool is_uneven(std::span<const ColumnContact> contacts) const;
  void find_lanes(std::span<const std::uint32_t> lanes, ThreadPool& pool);

  const BodyTable& bodies_;
  const BodyState& state_;
  const ContactGraph& graph_;
  std::vector<std::uint32_t> tops_;  // bodies whose one contact is with a body that has two
  std::vector<Found> found_;         // by chunk of `tops_`
  std::vector<Column> columns_, calm_;
  std::vector<ColumnContact> contacts_;
  std::vector<std::uint32_t> lane_of_;  // by contact
};

}  // namespace fathom::native
