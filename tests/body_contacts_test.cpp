#include "native/body_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace fathom::native::body_contacts_test {
namespace {

using Indices = std::vector<std::uint32_t>;

/// Contacts of some bodies, added and removed.
struct Contacts {
  static constexpr std::uint32_t slots = 30;
  std::vector<Contact> contacts;
  Indices free;
  BodyContacts lists;
  std::uint64_t made = 0;

  void make(std::uint32_t a, std::uint32_t b) {
    if (free.empty()) {
      free.push_back(static_cast<std::uint32_t>(contacts.size()));
      contacts.emplace_back();
    }
    const std::uint32_t index = free.back();
    free.pop_back();
    Contact& c = contacts[index] = {};
    c.a = a, c.b = b, c.born = made++, c.in_use = true;
    if (lists.are_kept()) lists.add(index, c);
  }
  void remove(std::uint32_t index) {
    if (contacts[index].in_use) free.push_back(index);
    contacts[index].in_use = false;
  }
  Indices of(std::uint32_t slot) { return lists.of(slot, contacts, slots); }
  Indices expected(std::uint32_t slot) const {
    Indices all;
    for (std::uint32_t i = 0; i < contacts.size(); ++i)
      if (contacts[i].in_use && (contacts[i].a == slot || contacts[i].b == slot)) all.push_back(i);
    std::sort(all.begin(), all.end(), [&](auto x, auto y) { return contacts[x].born > contacts[y].born; });
    return all;
  }
};

TEST(BodyContacts, NewestFirst) {
  Contacts c;
  c.make(0, 1), c.make(3, 0), c.make(1, 3), c.make(0, 5);
  EXPECT_EQ(c.of(0), (Indices{3, 1, 0}));
  EXPECT_EQ(c.of(2), Indices{});
  c.remove(1);
  EXPECT_EQ(c.of(0), (Indices{3, 0}));
  c.make(0, 2);  // in the removed one's slot
  EXPECT_EQ(c.of(0), (Indices{1, 3, 0}));
  EXPECT_EQ(c.of(3), Indices{2});
  EXPECT_EQ(c.of(2), Indices{1});
}

// Queried at varying intervals, so that lists are kept, rebuilt and left alone in between.
TEST(BodyContacts, AsASearchThroughAllWouldFindThem) {
  Contacts c;
  std::mt19937 random(7);
  for (int step = 0; step < 400; ++step) {
    for (std::size_t n = random() % 12; n > 0; --n) {
      const auto a = static_cast<std::uint32_t>(random() % 29);
      c.make(a, a + 1);
    }
    for (std::size_t n = random() % 12; n > 0 && !c.contacts.empty(); --n)
      c.remove(static_cast<std::uint32_t>(random() % c.contacts.size()));
    for (std::size_t n = step % 50 < 25 ? 0 : random() % 5; n > 0; --n) {
      const auto slot = static_cast<std::uint32_t>(random() % Contacts::slots);
      ASSERT_EQ(c.of(slot), c.expected(slot)) << "step " << step;
    }
  }
}

}  // namespace
}  // namespace fathom::native::body_contacts_test
