#include "native/body_contacts.hpp"

#include <algorithm>
#include <utility>

#include "world/growth.hpp"

namespace fathom::native {

void BodyContacts::add(std::uint32_t index, const Contact& contact) {
  if (newer_.empty()) first_newer_ = contact.born;
  make_room(newer_, newer_.size() + 1);
  newer_.push_back({index, contact.a, contact.b});
  if (2 * newer_.size() > listed_.size()) are_kept_ = false;
}

// Does not test `in_use`, an unpredictable branch.
void BodyContacts::list(std::span<const Contact> contacts, std::size_t slots) {
  are_kept_ = true;
  newer_.clear();
  looked_through_ = 0;
  grow_to(ends_, slots);
  std::fill(ends_.begin(), ends_.end(), 0);
  for (const Contact& c : contacts) ++ends_[c.a], ++ends_[c.b];
  std::uint32_t sum = 0;
  for (std::uint32_t& end : ends_) sum += std::exchange(end, sum);
  grow_to(listed_, sum);
  for (std::uint32_t i = 0; i < contacts.size(); ++i)
    listed_[ends_[contacts[i].a]++] = listed_[ends_[contacts[i].b]++] = i;
}

std::vector<std::uint32_t> BodyContacts::of(std::uint32_t slot, std::span<const Contact> contacts, std::size_t slots) {
  looked_through_ += newer_.size();
  if (!are_kept_ || looked_through_ > 2 * listed_.size()) list(contacts, slots);
  std::vector<std::uint32_t> found;
  // A contact's index may have been reused since.
  for (std::size_t i = newer_.size(); i-- > 0;)
    if (const Newer& n = newer_[i];
        (n.a == slot || n.b == slot) && contacts[n.contact].in_use && contacts[n.contact].born == first_newer_ + i)
      found.push_back(n.contact);
  if (slot >= ends_.size()) return found;  // added later
  const auto older = static_cast<std::ptrdiff_t>(found.size());
  for (std::size_t i = slot == 0 ? 0 : ends_[slot - 1]; i < ends_[slot]; ++i)
    if (const Contact& c = contacts[listed_[i]]; c.in_use && (newer_.empty() || c.born < first_newer_))
      found.push_back(listed_[i]);
  std::sort(found.begin() + older, found.end(),
            [&](std::uint32_t x, std::uint32_t y) { return contacts[x].born > contacts[y].born; });
  return found;
}

}  // namespace fathom::native
