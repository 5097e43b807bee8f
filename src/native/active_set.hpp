// Which bodies a step has to look at, as lists of slots.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/body_state.hpp"

namespace fathom::native {

/// Awake bodies that can move, and those of them that the solver moves. A list is made again when it is asked for
/// after something it depends on has changed.
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

  // As the last call of `refresh` or `refresh_in_contact` left them, ascending.
  std::span<const std::uint32_t> active() const { return active_; }
  std::span<const std::uint32_t> in_contact() const { return in_contact_; }
  std::span<const std::uint32_t> kinematic() const { return kinematic_; }  ///< of those in contact
  /// Changes with `in_contact`.
  std::uint64_t sorting() const { return sorting_; }

  /// Whether lists that count as current are what they would be if they were made again.
  bool agrees_with(const BodyTable& bodies, const BodyState& state) const;

  /// Takes bodies that were isolated within this step out of those in contact, which stay the same sorting.
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
