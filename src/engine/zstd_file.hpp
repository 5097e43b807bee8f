// A checksummed, compressed file: a 32-byte head (magic, version, length and XXH3 of the rest) and one zstd frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace fathom::engine {

struct FileKind {
  std::uint64_t magic;
  std::uint32_t version;
  const char* what;    ///< "recording", in error messages
  const char* remedy;  ///< where one comes from
};

/// Every function throws `Error{file}` if the file cannot be written.
class ZstdWriter {
 public:
  ZstdWriter(std::string path, const FileKind& kind);
  /// Without `finish` no file remains.
  ~ZstdWriter();
  ZstdWriter(const ZstdWriter&) = delete;
  ZstdWriter& operator=(const ZstdWriter&) = delete;

  void write(std::span<const std::byte> bytes);
  void finish();
  std::uint64_t bytes_written() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Every function throws `Error{file}` if the file is invalid.
class ZstdReader {
 public:
  /// Checks head, length and checksum of the whole file.
  ZstdReader(std::string path, const FileKind& kind);
  ~ZstdReader();
  ZstdReader(const ZstdReader&) = delete;
  ZstdReader& operator=(const ZstdReader&) = delete;

  void read(void* data, std::size_t size);
  template <class T>
  T read() {
    T value;
    read(&value, sizeof value);
    return value;
  }
  std::vector<std::byte> read_bytes(std::uint64_t size);
  [[noreturn]] void fail(const std::string& why) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fathom::engine
