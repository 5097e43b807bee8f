// Stubs for builds without a CUDA toolkit: there are no streams then, so only `has_streams` is ever called.
#include "exec/cuda/stream.hpp"

namespace fathom::exec::cuda {

namespace {

[[noreturn]] void refuse(const Where& where) {
  throw DeviceError(ErrorCode::unavailable, "this build has no CUDA streams", 0, where);
}

}  // namespace

bool has_streams() noexcept { return false; }
bool is_lost(Stream) noexcept { return false; }

StreamEvent::StreamEvent(int) { refuse(Where::current()); }
StreamEvent::~StreamEvent() = default;
void StreamEvent::mark(Stream, bool, const Where& where) { refuse(where); }
bool StreamEvent::is_done() const { return true; }
void StreamEvent::wait() const {}
double StreamEvent::milliseconds_since(const StreamEvent&) const { return 0; }

StreamGraph::~StreamGraph() = default;
void StreamGraph::begin(Stream, const Where& where) { refuse(where); }
StreamGraph StreamGraph::end(Stream, const Where& where) { refuse(where); }
void StreamGraph::abandon(Stream) noexcept {}
void StreamGraph::launch(Stream, const Where& where) { refuse(where); }

}  // namespace fathom::exec::cuda
