// Which contacts hang on each body. Only the application and islands that fall asleep or wake up want to know, of one
// body after the other, while a step may make and remove thousands of contacts. So lists are made when one is asked
// for, and contacts made later are looked through until that has taken longer than making the lists anew would.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact.hpp"

namespace fathom::native {

class BodyContacts {
 public:
  /// False where nobody has asked for long: then `add` need not be called.
  bool are_kept() const { return are_kept_; }
  /// A contact was made; they are added in the order of their birth.
  void add(std::uint32_t index, const Contact& contact);

  /// The contacts in use that hang on the body, the newest first, out of all `contacts` of `slots` bodies.
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
  std::vector<std::uint32_t> ends_;    // of each body's list, which begins where the last one's ends
  std::vector<std::uint32_t> listed_;  // contacts of all bodies
  std::vector<Newer> newer_;           // contacts made since, one birth after the other
  std::uint64_t first_newer_ = 0;      // birth
  std::size_t looked_through_ = 0;     // newer ones, since lists were made
};

}  // namespace fathom::native
