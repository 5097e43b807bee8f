// Which contacts make columns (dynamics/columns.hpp), and where the solver keeps them.
//
// A column's bodies have one or two contacts; below them may be one that cannot be pushed. It ends before a body with
// three contacts or more, so columns share no body and may be braced at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_graph.hpp"

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
  void update(std::span<const std::uint32_t> in_contact, std::span<const std::uint32_t> lanes);

  /// In the order of lanes.
  std::span<const Column> all() const { return columns_; }
  /// Those whose contacts are in lanes [begin, end).
  std::span<const Column> within(std::size_t begin, std::size_t end) const;
  const ColumnContact* contacts(const Column& c) const { return contacts_.data() + c.first; }
  std::size_t memory_bytes() const;

 private:
  bool is_part(std::uint32_t slot) const;
  bool has_two(std::uint32_t slot) const;
  std::uint32_t next_contact(std::uint32_t slot, std::uint32_t contact) const;
  void start_at(std::uint32_t slot);
  void follow(std::uint32_t below, std::uint32_t contact);
  void find_lanes(std::span<const std::uint32_t> lanes);

  const BodyTable& bodies_;
  const BodyState& state_;
  const ContactGraph& graph_;
  std::vector<Column> columns_;
  std::vector<ColumnContact> contacts_;
  std::vector<std::uint32_t> lane_of_;  // by contact
};

}  // namespace fathom::native
