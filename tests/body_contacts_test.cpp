#include "native/body_contacts.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fathom::native {
namespace {

std::vector<std::uint32_t> list(BodyContacts& lists, std::uint32_t slot, std::span<const Contact> contacts) {
  const auto of = lists.of(slot, contacts);
  return {of.begin(), of.end()};
}

Contact contact(std::uint32_t a, std::uint32_t b, std::uint64_t born) {
  Contact c;
  c.a = a, c.b = b, c.born = born, c.in_use = true;
  return c;
}

using Indices = std::vector<std::uint32_t>;

TEST(BodyContacts, NewestFirst) {
  const std::vector<Contact> contacts{contact(0, 1, 7), contact(3, 0, 9), contact(1, 3, 2), contact(0, 5, 8)};
  BodyContacts lists;
  EXPECT_EQ(list(lists, 0, contacts), (Indices{1, 3, 0}));
  EXPECT_EQ(list(lists, 1, contacts), (Indices{0, 2}));
  EXPECT_EQ(list(lists, 2, contacts), Indices{});
  EXPECT_EQ(list(lists, 3, contacts), (Indices{1, 2}));
  EXPECT_EQ(list(lists, 5, contacts), Indices{3});
  EXPECT_EQ(list(lists, 6, contacts), Indices{});  // a body that came later
}

// A removed contact's place goes to another only when contacts are made, and then the lists are made anew.
TEST(BodyContacts, RemovedStayUntilOthersAreMade) {
  std::vector<Contact> contacts{contact(0, 1, 0), contact(0, 2, 1)};
  BodyContacts lists;
  EXPECT_EQ(list(lists, 0, contacts), (Indices{1, 0}));
  contacts[1].in_use = false;
  EXPECT_EQ(list(lists, 0, contacts), (Indices{1, 0}));
  contacts[1] = contact(1, 2, 2);
  lists.forget();
  EXPECT_EQ(list(lists, 0, contacts), Indices{0});
  EXPECT_EQ(list(lists, 1, contacts), (Indices{1, 0}));
  EXPECT_EQ(list(lists, 2, contacts), Indices{1});
}

}  // namespace
}  // namespace fathom::native
