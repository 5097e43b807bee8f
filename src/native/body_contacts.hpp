// The contacts of each body. Only the application, and islands that fall asleep or wake, ask for them, one body at a
// time, whereas a step may create and remove thousands of contacts. So the lists are built on demand. Newer contacts
// are searched linearly until that has cost more than a rebuild.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact.hpp"

namespace fathom::native {

class BodyContacts {
 public:
  /// False if nobody has asked for a long time: `add` need not be called then.
  bool are_kept() const { return are_kept_; }
  /// A contact was made; call in order of birth.
  void add(std::uint32_t index, const Contact& contact);

  /// The body's contacts in use, newest first, from all `contacts` of `slots` bodies.
  std::vector<std::uint32_t> of(std::uint32_t slot, std::span<const Contact> contacts, std::size_t slots);

  std::size_t memory_bytes() const {
    return (ends_.capacity() + listed_.capacity()) * sizeof(std::uint32_t) + newer_.capacity() * sizeof(Newer);
  }

 private:
  struct Newer {
    std::uint32_t contact, a, b;
  };

  void list(std::span<const Contact> contacts, std::size_t slots);

  bool are_kept_ = false;
  std::vector<std::uint32_t> ends_;    // of each body's list, which begins at the previous end
  std::vector<std::uint32_t> listed_;  // contacts of all bodies
  std::vector<Newer> newer_;           // contacts made since, in order of birth
  std::uint64_t first_newer_ = 0;      // its birth
  std::size_t looked_through_ = 0;     // newer contacts, since the lists were built
};

}  // namespace fathom::native
