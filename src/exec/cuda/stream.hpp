// Events and graphs of CUDA streams. This host code includes no CUDA header, because SYCL devices use it too:
// AdaptiveCpp's queue on an NVIDIA GPU is such a stream.
#pragma once

#include <cstddef>
#include <utility>

#include "exec/error.hpp"

// The driver's types, under the names in its headers.
struct CUevent_st;
struct CUgraphExec_st;
struct CUstream_st;

namespace fathom::exec::cuda {

using Stream = CUstream_st*;

/// Whether this build has a CUDA toolkit, and therefore streams.
bool has_streams() noexcept;

/// Whether a kernel crashed, after which the program has lost the device.
bool is_lost(Stream stream) noexcept;

/// A point in a stream. An unmarked event counts as done. Any thread may query it.
class StreamEvent {
 public:
  /// Belongs to the device with this number; the thread's current device is unchanged.
  explicit StreamEvent(int device);
  ~StreamEvent();
  StreamEvent(const StreamEvent&) = delete;
  StreamEvent& operator=(const StreamEvent&) = delete;

  /// While recording, becomes a node of the graph that each replay passes again.
  void mark(Stream stream, bool recording, const Where& where);
  bool is_done() const;
  void wait() const;
  double milliseconds_since(const StreamEvent& begin) const;

 private:
  CUevent_st* event_ = nullptr;
};

/// The submissions to a stream between `begin` and `end`, recorded instead of run.
class StreamGraph {
 public:
  StreamGraph() = default;
  StreamGraph(StreamGraph&& other) noexcept
      : graph_(std::exchange(other.graph_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  StreamGraph& operator=(StreamGraph&& other) noexcept {
    std::swap(graph_, other.graph_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~StreamGraph();

  static void begin(Stream stream, const Where& where);
  static StreamGraph end(Stream stream, const Where& where);
  static void abandon(Stream stream) noexcept;

  void launch(Stream stream, const Where& where);
  /// Nodes that the driver replays: kernels, copies and fills.
  std::size_t size() const { return size_; }

 private:
  CUgraphExec_st* graph_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace fathom::exec::cuda
