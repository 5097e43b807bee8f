#include "world/excluded_pairs.hpp"

#include <algorithm>

#include "world/archive.hpp"
#include "world/body_table.hpp"

namespace fathom {

bool ExcludedPairs::contains(std::uint32_t a, std::uint32_t b) const { return std::ranges::binary_search(of(a), b); }

bool ExcludedPairs::add(std::uint32_t a, std::uint32_t b) {
  if (contains(a, b)) return false;
  of_body_.resize(std::max({of_body_.size(), std::size_t{a} + 1, std::size_t{b} + 1}));
  const auto list = [this](std::uint32_t body, std::uint32_t other) {
    std::vector<std::uint32_t>& others = of_body_[body];
    others.insert(std::ranges::lower_bound(others, other), other);
  };
  list(a, b), list(b, a);
  return true;
}

bool ExcludedPairs::remove(std::uint32_t a, std::uint32_t b) {
  if (!contains(a, b)) return false;
  std::erase(of_body_[a], b), std::erase(of_body_[b], a);
  return true;
}

void ExcludedPairs::save(ByteWriter& write) const {
  std::vector<std::uint32_t> pairs;
  for_each([&](std::uint32_t a, std::uint32_t b) { pairs.push_back(a), pairs.push_back(b); });
  write(pairs);
}

void ExcludedPairs::restore(ByteReader& in, const BodyTable& bodies) {
  std::vector<std::uint32_t> pairs;
  in(pairs);
  in.require(pairs.size() % 2 == 0);
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    const std::uint32_t a = pairs[i], b = pairs[i + 1];
    in.require(a < b && b < bodies.slot_count() && bodies.alive(a) && bodies.alive(b) && add(a, b));
  }
}

}  // namespace fathom
