// Bytes that know what they are and whether they are whole: magic, format version, size and checksum before the
// content.
//
// magic (u64) · version (u32) · reserved (u32) · size of the content (u64) · its XXH3 (u64) · content
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "world/archive.hpp"

namespace fathom {

struct SealKind {
  std::uint64_t magic;
  std::uint32_t version;
  const char* name;   ///< in errors: "snapshot"
  const char* thing;  ///< "snapshot of a world"
};

/// Empties `out` and begins it with a header, which `seal` completes.
void begin_sealed(const SealKind& kind, std::vector<std::byte>& out);
/// Call once the content is appended.
void seal(std::vector<std::byte>& out);
/// The content. Throws `Error{file}` if the bytes are of another kind or version, truncated or altered.
ByteReader unsealed(std::span<const std::byte> bytes, const SealKind& kind);

}  // namespace fathom
