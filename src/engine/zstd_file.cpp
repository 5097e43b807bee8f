#include "engine/zstd_file.hpp"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fathom/error.hpp>
#include <filesystem>
#include <fstream>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "files/output_file.hpp"

namespace fathom::engine {
namespace {

struct Head {
  std::uint64_t magic = 0;
  std::uint32_t version = 0, reserved = 0;
  std::uint64_t size = 0, sum = 0;
};
static_assert(sizeof(Head) == 32);

/// Fast enough to keep up with a simulation; higher levels compress states only slightly better.
constexpr int level = 1;

struct FreeHash {
  void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
};
using Hash = std::unique_ptr<XXH3_state_t, FreeHash>;

Hash new_hash() {
  Hash hash(XXH3_createState());
  XXH3_64bits_reset(hash.get());
  return hash;
}

}  // namespace

// --- writing ---------------------------------------------------------------------------------------------------

struct ZstdWriter::State {
  State(std::string path, const FileKind& kind) : file(std::move(path), files::Writing::patched) {
    head.magic = kind.magic;
    head.version = kind.version;
  }

  void compress(std::span<const std::byte> bytes, ZSTD_EndDirective directive) {
    ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
    for (;;) {
      ZSTD_outBuffer out{buffer.data(), buffer.size(), 0};
      const std::size_t left = ZSTD_compressStream2(stream.get(), &out, &in, directive);
      if (ZSTD_isError(left)) throw Error(ErrorCode::capacity, "compressing a recording: out of memory");
      file.write(buffer.data(), out.pos);
      XXH3_64bits_update(hash.get(), buffer.data(), out.pos);
      head.size += out.pos;
      if (directive == ZSTD_e_end ? left == 0 : in.pos == in.size) return;
    }
  }

  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  files::OutputFile file;
  Head head;
  std::unique_ptr<ZSTD_CCtx, Free> stream{ZSTD_createCCtx()};
  std::vector<std::byte> buffer = std::vector<std::byte>(ZSTD_CStreamOutSize());
  Hash hash = new_hash();
};

ZstdWriter::ZstdWriter(std::string path, const FileKind& kind)
    : state_(std::make_unique<State>(std::move(path), kind)) {
  ZSTD_CCtx_setParameter(state_->stream.get(), ZSTD_c_compressionLevel, level);
  state_->file.write(&state_->head, sizeof(Head));
}

ZstdWriter::~ZstdWriter() = default;

void ZstdWriter::write(std::span<const std::byte> bytes) { state_->compress(bytes, ZSTD_e_continue); }

void ZstdWriter::finish() {
  state_->compress({}, ZSTD_e_end);
  state_->head.sum = XXH3_64bits_digest(state_->hash.get());
  state_->file.overwrite(0, &state_->head, sizeof(Head));
  state_->file.finish();
}

std::uint64_t ZstdWriter::bytes_written() const { return sizeof(Head) + state_->head.size; }

// --- reading ---------------------------------------------------------------------------------------------------

struct ZstdReader::State {
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  std::string path;
  std::ifstream file;
  std::unique_ptr<ZSTD_DCtx, Free> stream{ZSTD_createDCtx()};
  std::vector<char> buffer = std::vector<char>(ZSTD_DStreamInSize());
  ZSTD_inBuffer in{nullptr, 0, 0};
};

ZstdReader::ZstdReader(std::string path, const FileKind& kind) : state_(std::make_unique<State>()) {
  state_->path = std::move(path);
  state_->file.open(state_->path, std::ios::binary);
  std::ifstream& file = state_->file;
  if (std::error_code failure; std::filesystem::is_directory(state_->path, failure))
    fail(std::string("is a folder; ") + kind.remedy);
  if (!file || file.peek() == std::ifstream::traits_type::eof())
    fail(std::string("no such file, or it is empty; ") + kind.remedy);
  Head head;
  file.read(reinterpret_cast<char*>(&head), sizeof head);
  if (file.gcount() < static_cast<std::streamsize>(sizeof head) || head.magic != kind.magic)
    fail(std::string("this is not a ") + kind.what + " of fathom; " + kind.remedy);
  if (head.version != kind.version)
    fail("it has format version " + std::to_string(head.version) + ", this build reads version " +
         std::to_string(kind.version) + "; use the build that wrote it");
  Hash hash = new_hash();
  std::uint64_t size = 0;
  while (file.read(state_->buffer.data(), static_cast<std::streamsize>(state_->buffer.size())), file.gcount() > 0) {
    XXH3_64bits_update(hash.get(), state_->buffer.data(), static_cast<std::size_t>(file.gcount()));
    size += static_cast<std::uint64_t>(file.gcount());
  }
  if (size < head.size)
    fail("it is truncated: " + std::to_string(size) + " of " + std::to_string(head.size) + " bytes are there");
  if (size > head.size || head.reserved != 0 || XXH3_64bits_digest(hash.get()) != head.sum)
    fail("its checksum does not match its content; it was altered");
  file.clear();
  file.seekg(sizeof head);
}

ZstdReader::~ZstdReader() = default;

void ZstdReader::read(void* data, std::size_t size) {
  ZSTD_outBuffer out{data, size, 0};
  while (out.pos < size) {
    if (state_->in.pos == state_->in.size) {
      state_->file.read(state_->buffer.data(), static_cast<std::streamsize>(state_->buffer.size()));
      state_->in = {state_->buffer.data(), static_cast<std::size_t>(state_->file.gcount()), 0};
    }
    const std::size_t before = out.pos;
    const bool at_end = state_->in.size == 0;
    const std::size_t left = ZSTD_decompressStream(state_->stream.get(), &out, &state_->in);
    if (ZSTD_isError(left)) fail(std::string("it cannot be decompressed: ") + ZSTD_getErrorName(left));
    if (at_end && out.pos == before) fail("it ends too early");
  }
}

std::vector<std::byte> ZstdReader::read_bytes(std::uint64_t size) {
  // Grows with the data read, so a wrong size does not request all memory.
  constexpr std::uint64_t portion = 1 << 24;
  std::vector<std::byte> bytes;
  while (bytes.size() < size) {
    const auto next = static_cast<std::size_t>(std::min(portion, size - bytes.size()));
    bytes.resize(bytes.size() + next);
    read(bytes.data() + bytes.size() - next, next);
  }
  return bytes;
}

void ZstdReader::fail(const std::string& why) const { throw Error(ErrorCode::file, state_->path + ": " + why); }

}  // namespace fathom::engine
