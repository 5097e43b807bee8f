// Which contacts hang on each body. Only the application and islands that fall asleep or wake up want to know, a body
// at a time, while a step may make and remove thousands of contacts. So these lists are made when one is asked for.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/contact.hpp"

namespace fathom::native {

class BodyContacts {
 public:
  /// Must be called when contacts were made. Removed ones stay listed.
  void forget() { are_current_ = false; }

  /// Contacts that hang on the body or did before they were removed (`Contact::in_use`), the newest first.
  std::span<const std::uint32_t> of(std::uint32_t slot, std::span<const Contact> contacts);

  std::size_t memory_bytes() const { return (ends_.capacity() + contacts_.capacity()) * sizeof(std::uint32_t); }

 private:
  void list(std::span<const Contact> contacts);

  std::vector<std::uint32_t> ends_;      // of each body's list, which begins where the last one's ends
  std::vector<std::uint32_t> contacts_;  // of all bodies
  bool are_current_ = false;
};

}  // namespace fathom::native
