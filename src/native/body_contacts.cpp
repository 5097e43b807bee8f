#include "native/body_contacts.hpp"

#include <algorithm>
#include <utility>

#include "world/growth.hpp"

namespace fathom::native {

void BodyContacts::list(std::span<const Contact> contacts) {
  are_current_ = true;
  ends_.clear();
  std::uint32_t sum = 0;
  const auto for_each = [&](const auto& act) {
    for (std::uint32_t i = 0; i < contacts.size(); ++i)
      if (contacts[i].in_use) act(i, contacts[i]);
  };
  std::size_t slots = 0;
  for_each([&](std::uint32_t, const Contact& c) { slots = std::max<std::size_t>({slots, c.a + 1, c.b + 1}); });
  make_room(ends_, slots);
  ends_.assign(slots, 0);
  for_each([&](std::uint32_t, const Contact& c) { ++ends_[c.a], ++ends_[c.b]; });
  for (std::uint32_t& end : ends_) sum += std::exchange(end, sum);
  grow_to(contacts_, sum);
  for_each([&](std::uint32_t i, const Contact& c) { contacts_[ends_[c.a]++] = contacts_[ends_[c.b]++] = i; });
}

std::span<const std::uint32_t> BodyContacts::of(std::uint32_t slot, std::span<const Contact> contacts) {
  if (!are_current_) list(contacts);
  if (slot >= ends_.size()) return {};
  const std::size_t begin = slot == 0 ? 0 : ends_[slot - 1];
  const std::span<std::uint32_t> list = std::span(contacts_).subspan(begin, ends_[slot] - begin);
  const auto newer = [&](std::uint32_t x, std::uint32_t y) { return contacts[x].born > contacts[y].born; };
  if (!std::is_sorted(list.begin(), list.end(), newer)) std::sort(list.begin(), list.end(), newer);
  return list;
}

}  // namespace fathom::native
