// Binary serialisation for snapshots and recordings. A type's `archive(self, a)` lists its members once; a `ByteWriter`
// appends them, a `ByteReader` reads them back. Trivially copyable members are copied byte for byte, so the format is
// that of little-endian machines with IEEE 754 floats.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fathom/error.hpp>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "world/large_array.hpp"

namespace fathom {

static_assert(std::endian::native == std::endian::little, "snapshots are little-endian");

/// Whether a bool copied from untrusted bytes has a valid value.
inline bool is_sound(const bool& value) {
  unsigned char byte;
  std::memcpy(&byte, &value, 1);
  return byte <= 1;
}

template <class T>
concept Plain = std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>;

class ByteWriter {
 public:
  static constexpr bool reading = false;

  /// Appends to `out`.
  explicit ByteWriter(std::vector<std::byte>& out) : out_(out) {}

  template <class... Parts>
  void operator()(const Parts&... parts) {
    (put(parts), ...);
  }
  void bytes(const void* data, std::size_t size) {
    const std::size_t at = out_.size();
    out_.resize(at + size);
    if (size > 0) std::memcpy(out_.data() + at, data, size);
  }

 private:
  template <Plain T>
  void put(const T& value) {
    bytes(&value, sizeof value);
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    if constexpr (Plain<T>)
      bytes(values.data(), values.size() * sizeof(T));
    else
      for (const T& value : values) put(value);
  }

  template <Plain T>
  void put(const LargeArray<T>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    bytes(values.data(), values.size() * sizeof(T));
  }

  std::vector<std::byte>& out_;
};

class ByteReader {
 public:
  static constexpr bool reading = true;

  /// `what` names the bytes in error messages.
  ByteReader(std::span<const std::byte> bytes, std::string what) : rest_(bytes), what_(std::move(what)) {}

  template <class... Parts>
  void operator()(Parts&... parts) {
    (get(parts), ...);
  }
  template <Plain T>
  T read() {
    T value;
    get(value);
    return value;
  }
  std::span<const std::byte> bytes(std::uint64_t size) {
    if (size > rest_.size()) fail("it ends too early");
    const auto taken = rest_.first(static_cast<std::size_t>(size));
    rest_ = rest_.subspan(static_cast<std::size_t>(size));
    return taken;
  }
  std::size_t left() const { return rest_.size(); }
  /// Throws `Error{file}`.
  [[noreturn]] void fail(const std::string& why) const { throw Error(ErrorCode::file, what_ + ": " + why); }
  void require(bool sound) const {
    if (!sound) fail("its content contradicts itself; it was altered or written by a faulty program");
  }
  /// Makes a check of the application's arguments one of the bytes.
  template <class Check>
  void require_valid(const Check& check) const {
    try {
      check();
    } catch (const Error& error) {
      fail(error.what());
    }
  }

 private:
  void get(bool& value) {
    const auto byte = read<std::uint8_t>();
    require(byte <= 1);
    value = byte == 1;
  }
  template <Plain T>
  void get(T& value) {
    std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
  }
  template <class T>
  void get(std::vector<T>& values) {
    const auto count = read<std::uint64_t>();
    // An element takes at least a byte: reject a count beyond the remaining bytes before allocating memory.
    if (count > rest_.size()) fail("it ends too early");
    if constexpr (Plain<T>) {
      get_plain(values, count);
    } else {
      values.resize(static_cast<std::size_t>(count));
      for (T& value : values) get(value);
    }
  }

  template <Plain T>
  void get(LargeArray<T>& values) {
    const auto count = read<std::uint64_t>();
    if (count > rest_.size()) fail("it ends too early");
    get_plain(values, count);
  }
  template <class Array>
  void get_plain(Array& values, std::uint64_t count) {
    const auto data = bytes(count * sizeof(values[0]));
    values.resize(static_cast<std::size_t>(count));
    if (count > 0) std::memcpy(static_cast<void*>(values.data()), data.data(), data.size());
  }

  std::span<const std::byte> rest_;
  std::string what_;
};

}  // namespace fathom
