#include "exec/cuda/stream.hpp"

#include <cuda_runtime_api.h>

#include "exec/cuda/check.hpp"

namespace fathom::exec::cuda {

bool has_streams() noexcept { return true; }

bool is_lost(Stream stream) noexcept { return is_lost_after(cudaStreamQuery(stream)); }

StreamEvent::StreamEvent(int device) {
  int before = device;
  (void)cudaGetDevice(&before);
  check(cudaSetDevice(device), "choosing a device", Where::current());
  const cudaError_t result = cudaEventCreate(&event_);
  (void)cudaSetDevice(before);
  check(result, "creating an event", Where::current());
}

StreamEvent::~StreamEvent() { (void)cudaEventDestroy(event_); }

void StreamEvent::mark(Stream stream, bool recording, const Where& where) {
  check(cudaEventRecordWithFlags(event_, stream, recording ? cudaEventRecordExternal : cudaEventRecordDefault),
        "marking an event", where);
}

bool StreamEvent::is_done() const {
  const cudaError_t result = cudaEventQuery(event_);
  if (result == cudaErrorNotReady) {
    (void)cudaGetLastError();
    return false;
  }
  check(result, "asking for an event", Where::current());
  return true;
}

void StreamEvent::wait() const { check(cudaEventSynchronize(event_), "waiting for an event", Where::current()); }

double StreamEvent::milliseconds_since(const StreamEvent& begin) const {
  float milliseconds = 0;
  check(cudaEventElapsedTime(&milliseconds, begin.event_, event_), "timing", Where::current());
  return static_cast<double>(milliseconds);
}

StreamGraph::~StreamGraph() {
  if (graph_) (void)cudaGraphExecDestroy(graph_);
}

void StreamGraph::begin(Stream stream, const Where& where) {
  // Relaxed mode, because the driver may still have to load a kernel that is used here for the first time. `Memory`
  // refuses allocations.
  check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed), "recording a graph", where);
}

void StreamGraph::abandon(Stream stream) noexcept {
  cudaGraph_t nodes = nullptr;
  (void)cudaStreamEndCapture(stream, &nodes);
  if (nodes) (void)cudaGraphDestroy(nodes);
  (void)cudaGetLastError();
}

StreamGraph StreamGraph::end(Stream stream, const Where& where) {
  StreamGraph graph;
  cudaGraph_t nodes = nullptr;
  check(cudaStreamEndCapture(stream, &nodes), "recording a graph", where);
  const cudaError_t counted = cudaGraphGetNodes(nodes, nullptr, &graph.size_);
  const cudaError_t instantiated = cudaGraphInstantiate(&graph.graph_, nodes, 0);
  (void)cudaGraphDestroy(nodes);
  check(counted, "recording a graph", where);
  check(instantiated, "instantiating a graph", where);
  check(cudaGraphUpload(graph.graph_, stream), "uploading a graph", where);
  return graph;
}

void StreamGraph::launch(Stream stream, const Where& where) {
  check(cudaGraphLaunch(graph_, stream), "launching a graph", where);
}

}  // namespace fathom::exec::cuda
