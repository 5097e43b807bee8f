// Which contacts make columns (dynamics/columns.hpp), and where the solver keeps them.
//
// A column begins with a body that has one contact, its top, and goes on through bodies that have two, to one that
// cannot be pushed or has one contact; it ends before a body with three or more. Columns share no body that can be
// pushed and may therefore be braced at once: columns of similar height lie side by side in a bundle's lanes. Rows that
// are held at both ends, as arches are, are none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/constraint_layout.hpp"
#include "native/contact_graph.hpp"
#include "native/solver_kernels.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

class Columns {
 public:
  Columns(const BodyTable& bodies, const BodyState& state, const ContactGraph& graph, const SolverKernels& kernels)
      : bodies_(bodies), state_(state), graph_(graph), kernels_(kernels) {}

  /// Finds them among the bodies `in_contact`, of which no island has more than `largest_island` contacts.
  void update(std::span<const std::uint32_t> in_contact, std::size_t largest_island, ThreadPool& pool);

  /// Looks which of them are to be braced in this step, and bundles those of each group, or all for all threads where
  /// there are no groups. The layout is the one that there was when they were found.
  void choose(const ConstraintLayout& layout, ThreadPool& pool);

  /// Those to be braced.
  std::span<const ColumnBundle> all() const { return bundles_; }
  std::span<const ColumnBundle> of_group(std::size_t group) const;
  std::size_t memory_bytes() const;

 private:
  /// A contact, between the body below and the one above.
  struct Link {
    std::uint32_t contact, lane;  ///< `lane` counts lanes of all blocks
    std::uint32_t below, above;   ///< slots
    bool upward;                  ///< B is above
  };
  struct Column {
    std::uint32_t lane;             ///< of its first contact
    std::uint32_t first, contacts;  ///< in the list of all
  };
  /// Columns of some of the tops; `first` counts from their own list's beginning.
  struct Found {
    std::vector<Column> columns;
    std::vector<Link> links;
  };

  int contacts_of(std::uint32_t slot) const;
  void find(std::span<const std::uint32_t> tops, Found& found) const;
  void follow_from(std::uint32_t top, Found& found) const;
  bool is_uneven(std::span<const Link> links) const;
  void find_lanes(std::span<const std::uint32_t> lanes, ThreadPool& pool);
  bool is_calm(const Column& c) const;
  void bundle(const ConstraintLayout& layout, ThreadPool& pool);
  void bundle(std::span<Column> columns, std::size_t bundles);
  void lay_out(std::span<const Column> columns);
  void place_bundles();

  const BodyTable& bodies_;
  const BodyState& state_;
  const ContactGraph& graph_;
  const SolverKernels& kernels_;
  bool any_is_uneven_ = false;       // bodies of very different mass may meet
  std::vector<std::uint32_t> tops_;  // bodies whose one contact is with a body that has two
  std::vector<Found> found_;         // by chunk of `tops_`
  std::vector<Column> columns_, calm_;
  std::vector<Link> links_;
  std::vector<std::uint32_t> lane_of_;  // by contact
  std::vector<bool> was_calm_;          // by column, when they were bundled
  bool is_bundled_ = false, knows_lanes_ = false;
  std::vector<ColumnBundle> bundles_;
  std::vector<std::size_t> first_of_group_;  // bundle, and their end
  // Of all bundles, one after the other.
  std::vector<std::uint32_t> lengths_, slots_, lanes_;
  std::vector<float> up_, work_;
};

}  // namespace fathom::native
