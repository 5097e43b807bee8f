// Detection on any device of the execution layer, with the device simulator's kernels.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "collision/collide.hpp"
#include "device/detection.hpp"
#include "device/device_memory.hpp"
#include "device/find_pairs.hpp"
#include "device/hull_memory.hpp"
#include "device/published/published_step.hpp"
#include "device/tuning.hpp"
#include "exec/device.hpp"
#include "math/team.hpp"

namespace fathom::device {

/// An update of a body's constants.
struct alignas(16) ConstantsUpdate {
  BodyConstants constants;
  std::uint32_t slot = 0;
  std::uint32_t unused[3] = {};
};

struct PutConstants {
  const ConstantsUpdate* updates;
  BodyConstants* constants;

  FATHOM_HD void operator()(std::uint32_t k) const { constants[updates[k].slot] = updates[k].constants; }
};

struct PutBoxes {
  const BoxUpdate* updates;
  NotedBox* fat;
  GridView grid;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const BoxUpdate u = updates[k];
    NotedBox box{u.lower, u.is_new ? static_cast<std::uint32_t>(box_change) : 0u, u.upper, 0};
    if (u.lower.x <= u.upper.x) box.level = grid.level_of(box.box());
    fat[u.slot] = box;
  }
};

/// The next search looks for the new boxes only.
struct ForgetNew {
  const BoxUpdate* updates;
  NotedBox* fat;

  FATHOM_HD void operator()(std::uint32_t k) const { fat[updates[k].slot].changes = 0; }
};

struct BeginSearch {
  Counters* counters;
  std::uint32_t slots;

  FATHOM_HD void operator()(std::uint32_t) const {
    counters->bodies = slots;
    counters->changed = 1;
    counters->stopped = 0;
    counters->contacts = 0;
  }
};

/// Results of a search that the host reads.
struct SearchReport {
  std::uint32_t found, max_overlaps;
};
struct WriteSearchReport {
  const Counters* counters;
  const SweepCounters* sweep;
  SearchReport* report;

  FATHOM_HD void operator()(std::uint32_t) const { *report = {counters->found, sweep->max_overlaps}; }
};

template <bool only_boxes>
struct CollideJobs {
  static constexpr std::uint32_t group_size = 64;  // few heavy items: small groups reach more compute units
  static constexpr bool runs_in_teams = !only_boxes;

  const CollideJob* jobs;
  CollideResult* results;
  Bodies<> bodies;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const CollideJob job = jobs[k];
    CollideResult result;
    result.axis = job.axis;
    if constexpr (only_boxes)
      result.manifold = collide_boxes(bodies.constants[job.a].half_extents, bodies.constants[job.b].half_extents,
                                      job.b_in_a, job.margin, result.axis, job.load);
    else
      result.manifold = collide_shapes(bodies.geometry_for_team(job.a), bodies.geometry_for_team(job.b), job.b_in_a,
                                       job.margin, result.axis, job.load);
    if (!runs_in_teams || team::is_leader()) results[k] = result;
  }
};

template <exec::Device D>
class DeviceDetection final : public Detection {
 public:
  template <class... Arguments>
  explicit DeviceDetection(const WorldDef& def, Arguments&&... device_arguments)
      : device_(std::forward<Arguments>(device_arguments)...),
        hulls_(device_),
        grid_(device_),
        published_(device_, 1),
        constants_(device_),
        fat_(device_),
        known_(device_),
        counters_(device_, 1),
        updates_(device_),
        update_staging_(device_, 0),
        constant_updates_(device_),
        constant_staging_(device_, 0),
        found_(device_),
        found_staging_(device_, 0),
        report_(device_, 1),
        searched_(device_) {
    settings_.sweep = def.broad_phase == BroadPhase::sweep;
    settings_.axis = def.sweep_axis;
    const exec::PinnedBuffer<Counters> initial(device_, 1);
    device_.copy_to_device(counters_.data(), initial.data(), 1);
    device_.wait();
    for (auto& portion : portions_) portion.emplace(device_);
  }
  ~DeviceDetection() override {
    try {
      device_.wait();
    } catch (const std::exception&) {
      // A lost device has nothing left to wait for.
    }
  }

  std::string hardware() const override {
    const exec::DeviceInfo& info = device_.info();
    return std::string(exec::name_of(info.backend)) + ":" + std::to_string(info.index) + " " + info.name;
  }
  exec::Traffic traffic() const override { return device_.traffic(); }
  std::size_t memory_bytes() const override { return device_.bytes_in_use(); }

  void set_body(std::uint32_t slot, const BodyInfo& info) override {
    ConstantsUpdate u;
    u.slot = slot;
    u.constants.bits = static_cast<std::uint32_t>(info.motion) | living_bit |
                       static_cast<std::uint32_t>(info.geometry.type) << shape_shift;
    u.constants.radius = info.radius;
    u.constants.half_extents = info.geometry.half_extents;
    u.constants.shape_radius = info.geometry.radius;
    u.constants.hull = hold_hull(slot, info.hull());
    // The host applies filters: here no body is filtered.
    new_bodies_.push_back(u);
    if (info.motion == MotionType::dynamic && settings_.wide_length == 0) radii_.push_back(info.radius);
  }

  void remove_body(std::uint32_t slot) override { hold_hull(slot, nullptr); }

  void begin_search(std::span<const BoxUpdate> boxes, std::uint32_t slots, bool set_changed) override {
    make_room(slots, boxes.size());
    choose_grid();
    upload_bodies();
    std::copy(boxes.begin(), boxes.end(), update_staging_.begin());
    update_count_ = static_cast<std::uint32_t>(boxes.size());
    slots_ = slots;
    set_changed_ = set_changed_ || set_changed;
    if (update_count_ > 0) {
      device_.copy_to_device(updates_.data(), update_staging_.data(), boxes.size());
      device_.parallel_for(update_count_, PutBoxes{updates_.data(), fat_.data(), grid_.grid(grid_base_)});
    }
    // The grid finds nothing new if nothing is new; the published sweep runs in every step.
    searching_ = update_count_ > 0 || set_changed_ || settings_.sweep;
    if (searching_) submit_search();
  }

  std::span<const PairRecord> found_pairs() override {
    if (!searching_) return {};
    searched_.wait();
    while (report_[0].found > found_.size() || report_[0].max_overlaps > slots_per_body_) {
      found_.grow(report_[0].found + report_[0].found / 4);
      slots_per_body_ = std::max(slots_per_body_, (report_[0].max_overlaps + 7) / 8 * 8);
      reserve_published();
      submit_search();
      searched_.wait();
    }
    const std::uint32_t count = report_[0].found;
    if (found_staging_.size() < count) {
      found_staging_ = exec::PinnedBuffer<PairRecord>(device_, count + count / 4);
      copied_ = 0;
    }
    if (count > copied_) {
      device_.copy_to_host(found_staging_.data(), found_.data(), count);
      device_.wait();
    }
    if (update_count_ > 0) device_.parallel_for(update_count_, ForgetNew{updates_.data(), fat_.data()});
    set_changed_ = false;
    return {found_staging_.data(), count};
  }

  CollideJob* jobs(std::uint32_t portion, std::uint32_t count) override {
    Portion& p = *portions_[portion];
    if (p.job_staging.size() < count) {
      const std::uint32_t room = count + count / 4;
      p.job_staging = exec::PinnedBuffer<CollideJob>(device_, room);
      p.result_staging = exec::PinnedBuffer<CollideResult>(device_, room);
      p.jobs.grow(room);
      p.results.grow(room);
    }
    return p.job_staging.data();
  }

  void collide(std::uint32_t portion, std::uint32_t boxes, std::uint32_t count) override {
    Portion& p = *portions_[portion];
    device_.copy_to_device(p.jobs.data(), p.job_staging.data(), count);
    if (boxes > 0) device_.parallel_for(boxes, CollideJobs<true>{p.jobs.data(), p.results.data(), bodies()});
    if (count > boxes)
      device_.parallel_for(count - boxes,
                           CollideJobs<false>{p.jobs.data() + boxes, p.results.data() + boxes, bodies()});
    device_.copy_to_host(p.result_staging.data(), p.results.data(), count);
    device_.mark(p.done);
  }

  const CollideResult* results(std::uint32_t portion) override {
    portions_[portion]->done.wait();
    return portions_[portion]->result_staging.data();
  }

 private:
  struct Portion {
    explicit Portion(D& device)
        : job_staging(device, 0), result_staging(device, 0), jobs(device), results(device), done(device) {}
    exec::PinnedBuffer<CollideJob> job_staging;
    exec::PinnedBuffer<CollideResult> result_staging;
    exec::Buffer<CollideJob> jobs;
    exec::Buffer<CollideResult> results;
    typename D::Event done;
  };

  /// Sets the hull of the body in `slot`, or none, and releases its previous one; returns the hull's index.
  std::uint32_t hold_hull(std::uint32_t slot, const std::shared_ptr<const Hull>& hull) {
    if (hull_of_.size() <= slot) hull_of_.resize(slot + 1 + slot / 2);
    if (hull) hulls_.begin_use(hull);
    // Between steps nothing is in flight.
    if (hull_of_[slot]) hulls_.end_use(hull_of_[slot], 0), hulls_.step_finished(0);
    hull_of_[slot] = hull.get();
    return hull ? hulls_.index_of(hull.get()) : 0;
  }

  void make_room(std::uint32_t slots, std::size_t updates) {
    if (slots > constants_.size()) {
      const std::size_t target = std::max<std::size_t>({slots, constants_.size() + constants_.size() / 2, 256});
      device_.wait();
      constants_.grow(target, exec::Contents::keep);
      fat_.grow(target, exec::Contents::keep);
      known_.grow(target);
      // The next search finds known pairs again: the host decides which are new.
      device_.fill(known_.data(), target, no_box());
      device_.fill(fat_.data() + filled_, target - filled_, no_box());
      filled_ = target;
      grid_.reserve(target);
      found_.grow(std::max<std::size_t>(2 * target, 2048));
    }
    if (updates > update_staging_.size()) {
      device_.wait();
      update_staging_ = exec::PinnedBuffer<BoxUpdate>(device_, updates + updates / 4);
      updates_.grow(update_staging_.size());
    }
  }

  /// Like the device simulator's: cells as large as the fat box of a typical body that turns but does not fly.
  void choose_grid() {
    if (grid_base_ == 0) {
      float typical = 1;
      if (!radii_.empty()) {
        const auto middle = radii_.begin() + static_cast<std::ptrdiff_t>(radii_.size() / 2);
        std::nth_element(radii_.begin(), middle, radii_.end());
        typical = *middle;
      }
      grid_base_ = grid_base(typical);
      settings_.wide_length = wide_bodies * grid_base_;
      radii_ = {};
    }
    reserve_published();
  }
  void reserve_published() {
    const std::size_t old = published_.order.size();
    const PublishedRoom room{constants_.size(), 64, 64, slots_per_body_};
    if (!published_.needs(settings_, room)) return;
    device_.wait();
    published_.reserve(settings_, room);
    set_changed_ = set_changed_ || published_.order.size() != old;
  }

  void upload_bodies() {
    if (new_bodies_.empty()) return;
    const std::size_t n = new_bodies_.size();
    device_.wait();
    if (!hulls_.is_current()) hulls_.upload(device_);
    if (constant_staging_.size() < n) constant_staging_ = exec::PinnedBuffer<ConstantsUpdate>(device_, n + n / 4);
    constant_updates_.grow(constant_staging_.size());
    // If a slot was filled twice, the last owner counts: items of a kernel have no order.
    std::stable_sort(new_bodies_.begin(), new_bodies_.end(),
                     [](const ConstantsUpdate& x, const ConstantsUpdate& y) { return x.slot < y.slot; });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (i + 1 == n || new_bodies_[i + 1].slot != new_bodies_[i].slot) constant_staging_[kept++] = new_bodies_[i];
    new_bodies_.clear();
    device_.copy_to_device(constant_updates_.data(), constant_staging_.data(), kept);
    device_.parallel_for(static_cast<std::uint32_t>(kept), PutConstants{constant_updates_.data(), constants_.data()});
  }

  BodyArrays bodies() {
    BodyArrays arrays{};
    arrays.constants = constants_.data();
    arrays.fat = fat_.data();
    arrays.known = known_.data();
    arrays.hulls = hulls_.arrays();
    return arrays;
  }

  void submit_search() {
    Counters* const c = counters_.data();
    ContactArrays contacts{};
    contacts.found = found_.data();
    contacts.capacity = static_cast<std::uint32_t>(found_.size());
    const BodyArrays arrays = bodies();
    const Grid grid = grid_.grid(grid_base_);
    device_.parallel_for(1, BeginSearch{c, slots_});
    device_.parallel_for(1, BeginStep{c, grid_.entries()});
    if (settings_.sweep) {
      PublishedStep<D> step(device_, published_, settings_, arrays, contacts, {}, c,
                            static_cast<std::uint32_t>(constants_.size()));
      step.find_pairs(set_changed_);
    } else {
      const std::uint32_t groups = (slots_ + search_group_bodies - 1) / search_group_bodies;
      device_.parallel_for(grid_.entries() / 4, ClearGrid{grid});
      device_.parallel_for(slots_, FillGrid{arrays, grid, c});
      device_.parallel_groups(groups, SearchGrid<false>{arrays, contacts, grid, c});
      device_.parallel_groups({&c->coarse_groups, groups}, SearchGrid<true>{arrays, contacts, grid, c});
    }
    device_.parallel_for(1, WriteSearchReport{c, published_.sweep(settings_).counters, report_.data()});
    copied_ = std::min<std::uint32_t>(prefetched_pairs, contacts.capacity);
    if (found_staging_.size() < copied_) found_staging_ = exec::PinnedBuffer<PairRecord>(device_, copied_);
    device_.copy_to_host(found_staging_.data(), found_.data(), copied_);
    device_.mark(searched_);
  }

  D device_;
  HullMemory hulls_;
  GridMemory grid_;
  PublishedMemory<D> published_;
  PublishedSettings settings_;
  exec::Buffer<BodyConstants> constants_;
  exec::Buffer<NotedBox> fat_, known_;
  exec::Buffer<Counters> counters_;
  exec::Buffer<BoxUpdate> updates_;
  exec::PinnedBuffer<BoxUpdate> update_staging_;
  exec::Buffer<ConstantsUpdate> constant_updates_;
  exec::PinnedBuffer<ConstantsUpdate> constant_staging_;
  exec::Buffer<PairRecord> found_;
  exec::PinnedBuffer<PairRecord> found_staging_;
  exec::PinnedBuffer<SearchReport> report_;
  typename D::Event searched_;
  std::optional<Portion> portions_[portions];

  std::vector<ConstantsUpdate> new_bodies_;
  std::vector<const Hull*> hull_of_;  // by slot
  std::vector<float> radii_;
  float grid_base_ = 0;
  std::size_t filled_ = 0;
  std::uint32_t slots_per_body_ = first_slots;
  std::uint32_t update_count_ = 0, slots_ = 0, copied_ = 0;
  bool set_changed_ = true, searching_ = false;
};

}  // namespace fathom::device
