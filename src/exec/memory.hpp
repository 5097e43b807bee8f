// The part of a device that allocates memory, separate from the part that runs kernels.
#pragma once

#include <cstddef>

#include "exec/error.hpp"

namespace fathom::exec {

/// Base of every device. Allocation is rare (start and growth), so a virtual call costs nothing, and `Buffer` can be
/// one type for all back ends. Throws DeviceError; never returns null for a size above 0.
class Memory {
 public:
  Memory() = default;
  virtual ~Memory() = default;
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  /// Memory that kernels use. Refused while a graph is being recorded: a graph replays addresses.
  void* allocate(std::size_t bytes, const Where& where) {
    check_not_recording(bytes, where);
    void* const memory = do_allocate(bytes, where);
    bytes_in_use_ += bytes;
    return memory;
  }
  /// Host memory that the device's copy engine reads and writes directly: copies are asynchronous.
  void* allocate_pinned(std::size_t bytes, const Where& where) {
    check_not_recording(bytes, where);
    return do_allocate_pinned(bytes, where);
  }
  /// Waits for submissions that may still use the memory.
  void release(void* memory, std::size_t bytes) noexcept {
    do_release(memory);
    bytes_in_use_ -= bytes;
  }
  virtual void release_pinned(void* memory) noexcept = 0;

  /// Submits a copy inside device memory, in order with the kernels.
  virtual void copy_bytes(void* to, const void* from, std::size_t bytes, const Where& where) = 0;

  /// Device memory held by all buffers of this device.
  std::size_t bytes_in_use() const { return bytes_in_use_; }
  bool is_recording() const { return recording_; }

 protected:
  void set_recording(bool recording) { recording_ = recording; }

  void check_can_record(const Where& where) const {
    if (recording_) throw DeviceError(ErrorCode::invalid_argument, "a graph is already being recorded", 0, where);
  }

 private:
  virtual void* do_allocate(std::size_t bytes, const Where& where) = 0;
  virtual void* do_allocate_pinned(std::size_t bytes, const Where& where) = 0;
  virtual void do_release(void* memory) noexcept = 0;

  void check_not_recording(std::size_t bytes, const Where& where) const {
    if (recording_) {
      throw DeviceError(ErrorCode::invalid_argument, "memory is allocated before a graph is recorded, not inside",
                        bytes, where);
    }
  }

  std::size_t bytes_in_use_ = 0;
  bool recording_ = false;
};

}  // namespace fathom::exec
