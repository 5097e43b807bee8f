// Pairs of bodies that the application excludes from collision.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace fathom {

class BodyTable;
class ByteReader;
class ByteWriter;

/// By slot. A body's pairs are removed before the body.
class ExcludedPairs {
 public:
  /// False if nothing changes.
  bool add(std::uint32_t a, std::uint32_t b);
  bool remove(std::uint32_t a, std::uint32_t b);
  bool contains(std::uint32_t a, std::uint32_t b) const;
  /// The bodies excluded from collision with this one, ascending.
  std::span<const std::uint32_t> of(std::uint32_t body) const {
    return body < of_body_.size() ? std::span<const std::uint32_t>(of_body_[body]) : std::span<const std::uint32_t>();
  }
  /// Calls act(a, b) for every pair, a < b, ascending.
  template <class Act>
  void for_each(const Act& act) const {
    for (std::uint32_t a = 0; a < of_body_.size(); ++a)
      for (const std::uint32_t b : of_body_[a])
        if (a < b) act(a, b);
  }

  void save(ByteWriter& write) const;
  /// Into an empty table. Throws `Error{file}` on impossible content.
  void restore(ByteReader& in, const BodyTable& bodies);

 private:
  std::vector<std::vector<std::uint32_t>> of_body_;  // up to the highest slot that ever had a pair
};

}  // namespace fathom
