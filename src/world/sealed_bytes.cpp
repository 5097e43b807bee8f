#include "world/sealed_bytes.hpp"

#include <cstring>
#include <string>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fathom {
namespace {

constexpr std::size_t head_size = 32;

std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data() + head_size, bytes.size() - head_size);
}

}  // namespace

void begin_sealed(const SealKind& kind, std::vector<std::byte>& out) {
  out.clear();
  ByteWriter write(out);
  write(kind.magic, kind.version, std::uint32_t{0}, std::uint64_t{0}, std::uint64_t{0});
}

void seal(std::vector<std::byte>& out) {
  const std::uint64_t size = out.size() - head_size, sum = checksum(out);
  std::memcpy(out.data() + 16, &size, sizeof size);
  std::memcpy(out.data() + 24, &sum, sizeof sum);
}

ByteReader unsealed(std::span<const std::byte> bytes, const SealKind& kind) {
  ByteReader in(bytes, kind.name);
  if (in.read<std::uint64_t>() != kind.magic) in.fail(std::string("this is no ") + kind.thing);
  const auto written_as = in.read<std::uint32_t>();
  if (written_as != kind.version)
    in.fail("it has format version " + std::to_string(written_as) + ", this build reads version " +
            std::to_string(kind.version) + "; use the build that wrote it");
  in.require(in.read<std::uint32_t>() == 0);
  const auto size = in.read<std::uint64_t>();
  const auto sum = in.read<std::uint64_t>();
  if (size != in.left())
    in.fail("it has " + std::to_string(in.left()) + " bytes of content instead of " + std::to_string(size) +
            "; it is truncated or altered");
  if (checksum(bytes) != sum) in.fail("its checksum does not match its content; it was altered");
  return in;
}

}  // namespace fathom
