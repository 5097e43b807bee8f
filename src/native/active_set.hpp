// The bodies that a step looks at, as lists of slots.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/body_state.hpp"

namespace fathom::native {

/// Awake bodies that can move, and the subset that the solver moves. A list is rebuilt on demand after something it
/// depends on has changed.
class ActiveSet {
 public:
  /// Bodies woke, fell asleep, were isolated, added or removed.
  void outdate() { is_current_ = in_contact_is_current_ = false; }
  /// Contacts or joints began or ended.
  void outdate_in_contact() { in_contact_is_current_ = false; }

  /// Brings the awake bodies up to date.
  void refresh(const BodyTable& bodies, const BodyState& state);
  /// Brings all lists up to date.
  void refresh_in_contact(const BodyTable& bodies, const BodyState& state);

  // Ascending, as of the last call of `refresh` or `refresh_in_contact`.
  std::span<const std::uint32_t> active() const { return active_; }
  std::span<const std::uint32_t> in_contact() const { return in_contact_; }
  std::span<const std::uint32_t> kinematic() const { return kinematic_; }  ///< of those in contact
  /// Changes with `in_contact`.
  std::uint64_t sorting() const { return sorting_; }

  /// Whether the lists marked as current equal rebuilt ones.
  bool agrees_with(const BodyTable& bodies, const BodyState& state) const;

  /// Removes bodies isolated within this step from `in_contact`; `sorting` does not change.
  void drop_isolated(const BodyState& state);

  std::size_t memory_bytes() const {
    return (active_.capacity() + in_contact_.capacity() + kinematic_.capacity()) * sizeof(std::uint32_t);
  }

 private:
  std::vector<std::uint32_t> active_, in_contact_, kinematic_;
  std::uint64_t sorting_ = 0;
  bool is_current_ = false;
  bool in_contact_is_current_ = false;
};

}  // namespace fathom::native
