// Graphs of closures, for devices whose back end has no graphs of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "exec/device.hpp"

namespace fathom::exec {

/// Runs submissions, or stores them while a graph is recorded. Base class of devices.
class ClosureQueue : public Memory {
 public:
  class Graph {
   public:
    std::size_t size() const { return steps_.size(); }

   private:
    friend class ClosureQueue;
    std::vector<std::function<void()>> steps_;
    Traffic traffic_;
  };

  const Traffic& traffic() const { return traffic_; }

  template <class Submissions>
  Graph record(Submissions&& submissions, Where where = Where::current()) {
    check_can_record(where);
    Graph graph;
    const Traffic before = traffic_;
    recording_into_ = &graph;
    set_recording(true);
    const auto stop = [&] {
      set_recording(false);
      recording_into_ = nullptr;
      graph.traffic_ = traffic_ - before;
      traffic_ = before;
    };
    try {
      submissions();
    } catch (...) {
      stop();
      throw;
    }
    stop();
    return graph;
  }
  void launch(Graph& graph, Where = Where::current()) {
    traffic_ += graph.traffic_;
    for (const std::function<void()>& step : graph.steps_) step();
  }

 protected:
  template <class Step>
  void submit(Step step) {
    if (recording_into_)
      recording_into_->steps_.emplace_back(std::move(step));
    else
      step();
  }
  template <class Step>
  void launch_step(Step step) {
    ++traffic_.launches;
    submit(std::move(step));
  }

  Traffic traffic_;

 private:
  Graph* recording_into_ = nullptr;
};

}  // namespace fathom::exec
