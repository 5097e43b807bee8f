// Anything may be created, destroyed, thrown and changed inside any callback.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>
#include <numeric>
#include <random>

#include "engine/recording.hpp"
#include "engine_fixture.hpp"

namespace fathom::engine::test::engine_callbacks_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* modes[] = {"lockstep", "ahead", "async"};
constexpr const char* simulators[] = {"native", "device", "hybrid"};

Config in_mode(const char* mode) {
  Config config = quiet_config();
  config.set(std::string("simulator.mode=") + mode);
  return config;
}

EntityDef falling(Vec3 position, TickPhase phase = TickPhase::none) {
  EntityDef def;
  def.physics = cube(position);
  def.tick = phase;
  return def;
}

std::uint32_t bodies_in(Engine& engine) {
  std::uint32_t count = 99;
  engine.simulation().inspect([&](const CommandRunner& runner) { count = runner.world().body_count(); });
  return count;
}

class Calling final : public Entity {
 public:
  std::function<void(Engine&, EntityDef&)> at_creation = [](Engine&, EntityDef&) {};
  std::function<void(Engine&)> at_end = [](Engine&) {};
  std::function<void(Entity&, const Tick&)> at_tick = [](Entity&, const Tick&) {};
  void created(Engine& engine, EntityDef& def) override { at_creation(engine, def); }
  void destroyed(Engine& engine) override { at_end(engine); }
  void tick(const Tick& tick) override { at_tick(*this, tick); }
};

TEST(EngineCallbacks, WhatIsDestroyedInItsCreationLivesForAFrame) {
  Engine engine(quiet_config());
  auto entity = std::make_unique<Calling>();
  Calling& calling = *entity;
  int ticks = 0, ends = 0;
  calling.at_creation = [&](Engine& e, EntityDef&) { EXPECT_TRUE(e.world().destroy(calling.id())); };
  calling.at_tick = [&](Entity&, const Tick&) { ++ticks; };
  calling.at_end = [&](Engine&) { ++ends; };
  const EntityId id = engine.world().spawn(falling({0, 0, 5}, TickPhase::before), std::move(entity));
  engine.run(4);
  EXPECT_EQ(engine.world().find(id), nullptr);
  EXPECT_FALSE(engine.world().destroy(id));
  EXPECT_EQ(engine.world().count(), 0u);
  EXPECT_EQ(ticks, 1);
  EXPECT_EQ(ends, 1);
  EXPECT_EQ(bodies_in(engine), 0u);
}

TEST(EngineCallbacks, WhatThrowsInItsCreationDoesNotComeToLife) {
  Engine engine(quiet_config());
  auto entity = std::make_unique<Calling>();
  entity->at_creation = [](Engine&, EntityDef&) { throw std::runtime_error("not today"); };
  const EntityId stillborn = engine.world().spawn(falling({0, 0, 5}), std::move(entity));
  const EntityId other = engine.world().spawn(falling({5, 0, 5}));
  EXPECT_THROW(engine.run(2), std::runtime_error);
  EXPECT_EQ(engine.world().find(stillborn), nullptr);
  EXPECT_NE(engine.world().find(other), nullptr);
  EXPECT_EQ(engine.steps(), 1u) << "the frame was made to its end";
  engine.run(2);
  EXPECT_EQ(engine.steps(), 3u);
  EXPECT_EQ(bodies_in(engine), 1u);
}

TEST(EngineCallbacks, AnExceptionAtAnEndSparesNobodyElseTheirs) {
  Engine engine(quiet_config());
  std::vector<EntityId> ids;
  int ends = 0;
  for (int i = 0; i < 5; ++i) {
    auto entity = std::make_unique<Calling>();
    entity->at_end = [&, i](Engine& e) {
      ++ends;
      e.world().spawn(falling({0, 0, 50.0f + static_cast<float>(i)}));
      if (i % 2 == 0) throw std::runtime_error("end " + std::to_string(i));
    };
    ids.push_back(engine.world().spawn(falling({2.0f * static_cast<float>(i), 0, 5}), std::move(entity)));
  }
  engine.run(1);
  for (const EntityId id : ids) engine.world().destroy(id);
  try {
    engine.run(5);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "end 0") << "the first";
  }
  EXPECT_EQ(ends, 5);
  for (const EntityId id : ids) EXPECT_EQ(engine.world().find(id), nullptr);
  engine.run(1);
  EXPECT_EQ(bodies_in(engine), 5u);
}

// The step of an exception is completed, for everybody, in every mode; the next run continues as if nothing had been
// thrown.
TEST(EngineCallbacks, AnExceptionInATickOrATimerEndsTheRunAfterTheFrame) {
  for (const char* mode : modes) {
    for (const char* where : {"before", "during", "after", "timer", "wall timer", "frame", "action"}) {
      Config config = in_mode(mode);
      config.set("input.actions.go=g");
      Engine engine(config);
      bool thrown = false;
      const auto act = [&](const char* here) {
        if (std::string_view(here) != where || engine.steps() < 5 || thrown) return;
        thrown = true;
        throw std::runtime_error(here);
      };
      const EntityId id = engine.world().spawn(falling({0, 0, 5}));
      int ticks = 0;
      for (const auto& [phase, name] :
           {std::pair{TickPhase::before, "before"}, {TickPhase::during, "during"}, {TickPhase::after, "after"}}) {
        EntityDef def;
        def.tick = phase;
        engine.world().spawn(def, [&, name = name](Entity&, const Tick&) { act(name); });
        engine.world().spawn(def, [&](Entity&, const Tick&) { ++ticks; });
      }
      engine.timers().every(1e-3, [&] { act("timer"); });
      engine.timers().every(
          1e-6, [&] { act("wall timer"); }, TimeBase::wall);
      engine.on_frame([&](Engine& e) {
        e.inject({InputKind::key_pressed, 0, 'G', 0, 0});
        act("frame");
      });
      engine.input().on_action("go", [&](bool) { act("action"); });
      EXPECT_THROW(engine.run(), std::runtime_error) << mode << ", " << where;
      const std::uint64_t steps = engine.steps();
      EXPECT_EQ(engine.simulation().completed(), steps) << mode << ", " << where << ": no step is under way";
      EXPECT_EQ(ticks % 3, 0) << "what ticks after it has ticked, too";
      engine.run(10);
      EXPECT_EQ(engine.steps(), steps + 10) << mode << ", " << where;
      EXPECT_EQ(engine.simulation().completed(), steps + 10) << mode << ", " << where;
      EXPECT_NE(engine.world().find(id), nullptr);
    }
  }
}

TEST(EngineCallbacks, TheLogSaysWhatElseWasThrown) {
  const Folder folder;
  Config config = quiet_config();
  config.edit().log.file = folder / "log";
  Engine engine(config);
  engine.on_frame([](Engine&) { throw std::runtime_error("first"); });
  engine.on_frame([](Engine&) { throw std::runtime_error("second"); });
  engine.on_frame([](Engine&) { throw 3; });
  EXPECT_THROW(engine.frame(), std::runtime_error);
  engine.log().flush();
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("frame 1: second"));
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("frame 1: an exception that is not a std::exception"));
}

TEST(EngineCallbacks, TheLoopIsNotEnteredTwice) {
  for (const char* mode : modes) {
    Engine engine(in_mode(mode));
    std::vector<std::string> said;
    engine.on_frame([&](Engine& e) {
      said = {refusal([&] { e.frame(); }), refusal([&] { e.run(1); }), refusal([&] { e.finish(); })};
    });
    engine.run(2);
    for (const std::string& text : said) EXPECT_THAT(text, HasSubstr("it was called from a callback"));
    said.clear();
    engine.end_when([&] {
      said = {refusal([&] { engine.frame(); }), refusal([&] { engine.run(1); }), refusal([&] { engine.finish(); })};
      return false;
    });
    engine.run(1);
    for (const std::string& text : said) EXPECT_THAT(text, HasSubstr("it was called from a callback"));
    engine.finish();
    engine.finish();
    EXPECT_THAT(refusal([&] { engine.run(1); }), HasSubstr("the engine was finished"));
    EXPECT_THAT(refusal([&] { engine.frame(); }), HasSubstr("the engine was finished"));
  }
}

TEST(EngineCallbacks, CallbacksMayAddCallbacks) {
  Engine engine(quiet_config());
  int calls = 0;
  std::function<void(Engine&)> more = [&](Engine& e) {
    if (++calls < 100) e.on_frame(more);
  };
  engine.on_frame(more);
  engine.run(8);
  EXPECT_GE(calls, 100);
}

TEST(EngineCallbacks, LookingAtTheWorldNestsAndRefusesToWait) {
  Engine engine(quiet_config());
  EntityDef def;
  def.tick = TickPhase::during;
  int looks = 0;
  engine.world().spawn(def, [&](Entity&, const Tick& tick) {
    Simulation& simulation = tick.engine.simulation();
    simulation.inspect([&](const CommandRunner&) {
      simulation.inspect([&](const CommandRunner&) { ++looks; });
      // It may already be complete.
      const std::string said = refusal([&] { simulation.wait_for(tick.step); });
      EXPECT_TRUE(said.empty() || said.find("inspect() holds the world") != said.npos) << said;
    });
  });
  engine.run(20);
  EXPECT_EQ(looks, 20);
}

// --- timers ----------------------------------------------------------------------------------------------------

TEST(EngineCallbacks, TimersFireAtTheStepThatEndsAtTheirTime) {
  struct Case {
    const char* dt;
    double period;
    std::uint64_t step;
  };
  for (const Case& c : {Case{"0.01", 0.1, 10},
                        {"0.01", 0.01, 1},
                        {"0.005", 0.1, 20},
                        {"0.02", 0.1, 5},
                        {"0.016666667", 0.5, 30},
                        {"0.016666666", 0.5, 30},
                        {"0.0083333333", 0.25, 30},
                        {"0.033333333", 1, 30},
                        {"0.001", 0.3, 300},
                        {"0.0041666667", 1, 240},
                        {"0.016", 0.08, 5}}) {
    Config config = quiet_config();
    config.set(std::string("simulator.dt=") + c.dt);
    Engine engine(config);
    std::vector<std::uint64_t> steps;
    engine.timers().every(c.period, [&] { steps.push_back(engine.steps()); });
    std::uint64_t once = 0;
    engine.timers().after(c.period, [&] { once = engine.steps(); });
    engine.run(20 * c.step);
    ASSERT_EQ(steps.size(), 20u) << c.dt << ", " << c.period;
    for (std::uint64_t i = 0; i < 20; ++i) EXPECT_EQ(steps[i], (i + 1) * c.step) << c.dt << ", " << c.period;
    EXPECT_EQ(once, c.step);
  }
}

TEST(EngineCallbacks, RepeatingTimersDoNotDrift) {
  Timers timers;
  std::uint64_t fired = 0;
  timers.every(0.1, [&] { ++fired; });
  for (std::uint64_t step = 1; step <= 1'000'000; ++step) {
    Failures none;
    timers.advance(TimeBase::simulated, static_cast<double>(step) * 0.01, 1e-8, none);
    ASSERT_EQ(fired, step / 10);
  }
}

TEST(EngineCallbacks, NoTimerFiresWithoutEnd) {
  Timers timers;
  EXPECT_THAT(refusal([&] { timers.every(1e-18, [] {}); }), HasSubstr("the period is 1e-18 s; it must be finite and"));
  const TimerId id = timers.every(1, [] {});
  EXPECT_THAT(refusal([&] { timers.reset(id, 1e-300); }), HasSubstr("at least a microsecond"));
  int calls = 0;
  std::function<void()> again = [&] { ++calls, timers.after(0, again); };
  timers.after(0, again);
  timers.advance(TimeBase::simulated, 1e-3);
  EXPECT_GE(calls, 999);
  EXPECT_LE(calls, 1002);
}

TEST(EngineCallbacks, ATimerThatThrowsSparesNoOther) {
  Timers timers;
  std::vector<int> fired;
  for (int i = 0; i < 4; ++i)
    timers.every(1, [&, i] {
      fired.push_back(i);
      if (i == 1) throw std::runtime_error("one");
    });
  EXPECT_THROW(timers.advance(TimeBase::simulated, 2), std::runtime_error);
  EXPECT_THAT(fired, ElementsAre(0, 1, 2, 3, 0, 1, 2, 3));
  timers.advance(TimeBase::simulated, 2.5);
  EXPECT_EQ(fired.size(), 8u);
}

// --- input -----------------------------------------------------------------------------------------------------

InputEvent key(char code, bool pressed = true) {
  return {pressed ? InputKind::key_pressed : InputKind::key_released, 0, static_cast<std::uint16_t>(code), 0, 0};
}

void send(Input& input, InputEvent event) { input.dispatch(std::span(&event, 1)); }

TEST(EngineCallbacks, AReleasedKeyIsUpWhoeverConsumesIt) {
  Input input;
  input.bind("thrust", "space");
  std::vector<bool> told;
  input.on_action("thrust", [&](bool pressed) { told.push_back(pressed); });
  bool menu = false;
  input.add_handler(5, [&](const InputEvent&) { return menu; });
  send(input, key(' '));
  EXPECT_TRUE(input.held("thrust"));
  menu = true;
  send(input, key(' ', false));
  EXPECT_FALSE(input.held("thrust"));
  EXPECT_THAT(told, ElementsAre(true, false));
  send(input, key(' '));
  EXPECT_FALSE(input.held("thrust")) << "the menu has it";
  send(input, key(' ', false));
  EXPECT_THAT(told, ElementsAre(true, false));
  menu = false;
  send(input, key(' '));
  send(input, {InputKind::window_unfocused, 0, 0, 0, 0});
  EXPECT_FALSE(input.held("thrust")) << "its release goes elsewhere";
  EXPECT_THAT(told, ElementsAre(true, false, true, false));
}

TEST(EngineCallbacks, AnActionIsUpWhenItsLastKeyIs) {
  Input input;
  input.bind("thrust", "space");
  input.bind("thrust", "j");
  std::vector<bool> told;
  input.on_action("thrust", [&](bool pressed) { told.push_back(pressed); });
  send(input, key(' '));
  send(input, key('J'));
  send(input, key(' ', false));
  EXPECT_TRUE(input.held("thrust"));
  EXPECT_THAT(told, ElementsAre(true, true));
  send(input, key('J', false));
  EXPECT_FALSE(input.held("thrust"));
  EXPECT_THAT(told, ElementsAre(true, true, false));
  send(input, key(' '));
  send(input, key(' '));  // a press whose release was lost
  send(input, key(' ', false));
  EXPECT_FALSE(input.held("thrust"));
}

TEST(EngineCallbacks, ActionHandlersMayComeAndGoWhileTheyAreTold) {
  Input input;
  input.bind("jump", "j");
  int removed = 0, added = 0;
  Input::HandlerId later = 0;
  input.on_action("jump", [&](bool) {
    input.remove_handler(later);
    input.bind("zoom", "j");
    input.on_action("zoom", [&](bool) { ++added; });
    input.on_action("jump", [&](bool) { ++added; });
  });
  later = input.on_action("jump", [&](bool) { ++removed; });
  send(input, key('J'));
  EXPECT_EQ(removed, 0);
  EXPECT_EQ(added, 0);
}

TEST(EngineCallbacks, AHandlerThatThrowsSparesNoOther) {
  Input input;
  input.bind("jump", "j");
  int calls = 0;
  input.add_handler(1, [](const InputEvent&) -> bool { throw std::runtime_error("handler"); });
  input.add_handler(1, [&](const InputEvent&) { return ++calls, false; });
  input.on_action("jump", [&](bool) { throw std::runtime_error("action"); });
  input.on_action("jump", [&](bool) { ++calls; });
  const InputEvent events[] = {key('J'), key('J', false)};
  try {
    input.dispatch(events);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "handler");
  }
  EXPECT_EQ(calls, 4);
  EXPECT_FALSE(input.held("jump"));
}

// --- all of them -----------------------------------------------------------------------------------------------

/// Callbacks of every kind that only count their calls, and throw at one of them.
class Counted final : public FrontEnd {
 public:
  explicit Counted(int target) : target_(target) {}
  void begin(Engine& engine) {
    engine_ = &engine;
    for (int i = 0; i < 3; ++i) engine.world().spawn(falling({2.0f * static_cast<float>(i), 0, 5}));
    for (const auto& [phase, name] :
         {std::pair{TickPhase::before, "before"}, {TickPhase::during, "during"}, {TickPhase::after, "after"}}) {
      const auto count = [this, name = name](Entity&, const Tick&) { call(name); };
      EntityDef def;
      def.tick = phase;
      engine.world().spawn(def, count);
      engine.world().spawn(def, count);
    }
    engine.on_frame([this](Engine&) {
      come_and_go();
      call("frame");
    });
    engine.timers().every(0.02, [this] { call("timer"); });
    engine.timers().after(0.05, [this] { call("once"); });
    engine.timers().every(
        1e-6,
        [this] {
          // Once per frame, however long that takes.
          if (std::exchange(wall_polls_, polls_) != polls_) call("wall timer");
        },
        TimeBase::wall);
    engine.input().bind("go", "g");
    engine.input().add_handler(1, [this](const InputEvent&) { return call("handler"), false; });
    engine.input().on_action("go", [this](bool) { call("action"); });
    engine.end_when([this] { return call("end"), false; });
  }
  void poll(std::vector<InputEvent>& events) override {
    const auto kind = polls_++ % 2 == 0 ? InputKind::key_pressed : InputKind::key_released;
    events.push_back({kind, 0, 'G', 0, 0});
    call("poll");
  }
  void draw(const DrawFrame&) override { call("draw"); }

  const std::string& thrown() const { return thrown_; }
  int count(const std::string& name) { return calls_[name]; }

 private:
  void call(const char* name) {
    ++calls_[name];
    if (++all_ != target_) return;
    thrown_ = name;
    throw std::runtime_error(name);
  }
  /// In every frame an entity is created and that of the previous frame destroyed.
  void come_and_go() {
    engine_->world().destroy(guest_);
    auto guest = std::make_unique<Calling>();
    guest->at_creation = [this](Engine&, EntityDef&) { call("created"); };
    guest->at_end = [this](Engine&) { call("destroyed"); };
    guest_ = engine_->world().spawn({}, std::move(guest));
  }

  Engine* engine_ = nullptr;
  EntityId guest_{};
  int target_, all_ = 0, polls_ = 0, wall_polls_ = 0;
  std::map<std::string, int> calls_;
  std::string thrown_;
};

TEST(EngineCallbacks, AnExceptionAtAnyCallSparesNoOtherAndChangesNoState) {
  std::map<std::string, int> thrown;
  for (const char* simulator : simulators) {
    for (const char* mode : modes) {
      std::uint64_t expected = 0;
      // The native simulator throws at each call, the others at some.
      const int stride = simulator == std::string("native") ? 1 : 7;
      for (int target = 0; target < 160; target += stride) {
        const std::string what = fmt::format("{}, {}, call {}", simulator, mode, target);
        Config config = in_mode(mode);
        config.set(std::string("simulator.kind=") + simulator);
        config.set("simulator.device=host");
        config.set("log.level=off");
        Counted counted(target);
        Engine engine(config, &counted);
        counted.begin(engine);
        std::string caught;
        try {
          engine.run(10);
        } catch (const std::runtime_error& error) {
          caught = error.what();
          EXPECT_EQ(engine.simulation().completed(), engine.steps()) << what << ": no step is under way";
        }
        EXPECT_EQ(caught, counted.thrown()) << what;
        ++thrown[caught];
        if (engine.steps() < 10) engine.run(10 - engine.steps());
        EXPECT_EQ(engine.steps(), 10u) << what << " in " << caught;
        EXPECT_EQ(engine.simulation().completed(), 10u) << what << " in " << caught;
        for (const char* phase : {"before", "during", "after"}) {
          if (mode != std::string("async")) {
            EXPECT_EQ(counted.count(phase), 20) << what << " in " << caught;
          }
          EXPECT_EQ(counted.count(phase) % 2, 0) << what << " in " << caught;
        }
        std::uint64_t hash = 0;
        engine.simulation().inspect([&](const CommandRunner& runner) { hash = runner.world().state_hash(); });
        if (target == 0) expected = hash;
        EXPECT_EQ(hash, expected) << what << " in " << caught;
      }
    }
  }
  for (const char* name : {"before", "during", "after", "frame", "timer", "once", "wall timer", "handler", "action",
                           "end", "poll", "draw", "created", "destroyed"})
    EXPECT_GT(thrown[name], 0) << name;
}

// --- at random -------------------------------------------------------------------------------------------------

/// Callbacks of all kinds, in random order, with random actions: create, destroy, push, pause, set and cancel timers,
/// add and remove handlers, stop, throw.
class Chaos {
 public:
  Chaos(Engine& engine, std::uint32_t seed) : engine_(engine), random_(seed) {
    std::vector<int> order(40);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random_);
    for (const int kind : order) add(kind % 8);
  }
  int thrown() const { return thrown_; }

 private:
  bool chance(double share) { return std::uniform_real_distribution(0.0, 1.0)(random_) < share; }

  void maybe_throw() {
    if (!chance(0.01)) return;
    ++thrown_;
    throw std::runtime_error("chaos");
  }

  void spawn() {
    auto entity = std::make_unique<Calling>();
    Calling* const self = entity.get();
    entity->at_creation = [this, self](Engine& e, EntityDef& def) {
      if (chance(0.1)) def.simulated = false;
      if (chance(0.1)) e.world().destroy(self->id());
      maybe_throw();
    };
    entity->at_end = [this](Engine&) {
      if (chance(0.5)) spawn();
      maybe_throw();
    };
    entity->at_tick = [this](Entity& me, const Tick&) {
      if (me.has_physics() && chance(0.5)) me.apply_force({0, 0, 5});
      act();
    };
    const auto phase = static_cast<TickPhase>(std::uniform_int_distribution(0, 3)(random_));
    const Vec3 place{std::uniform_real_distribution(-5.0f, 5.0f)(random_), 0, 20};
    ids_.push_back(engine_.world().spawn(falling(place, phase), std::move(entity)));
  }

  void act() {
    if (chance(0.05) && engine_.world().count() < 60) spawn();
    if (!ids_.empty() && chance(0.06)) engine_.world().destroy(ids_[random_() % ids_.size()]);
    if (chance(0.02)) engine_.timers().after(chance(0.5) ? 0 : 0.03, [this] { act(); });
    if (chance(0.02)) engine_.inject({InputKind::key_pressed, 0, 'G', 0, 0});
    if (chance(0.02)) engine_.inject({InputKind::key_released, 0, 'G', 0, 0});
    if (chance(0.01)) engine_.set_paused(true), engine_.single_step();
    if (chance(0.1)) engine_.set_paused(false);
    if (chance(0.005)) engine_.stop();
    maybe_throw();
  }

  void add(int kind) {
    if (kind < 3) return spawn();
    if (kind == 3) return engine_.on_frame([this](Engine&) { act(); });
    if (kind == 4) return void(engine_.timers().every(0.02, [this] { act(); }));
    if (kind == 5)
      return void(engine_.timers().every(
          1e-3, [this] { act(); }, TimeBase::wall));
    if (kind == 6) {
      engine_.input().bind("go", "g");
      engine_.input().on_action("go", [this](bool) { act(); });
      return;
    }
    engine_.input().add_handler(1, [this](const InputEvent&) { return act(), chance(0.3); });
  }

  Engine& engine_;
  std::mt19937 random_;
  std::vector<EntityId> ids_;
  int thrown_ = 0;
};

// CI runs a few schedules; the environment variable FATHOM_SCHEDULES sets the number for each mode and simulator.
TEST(EngineCallbacks, RandomSchedulesLeaveTheEngineSound) {
  const char* asked = std::getenv("FATHOM_SCHEDULES");
  const std::uint32_t schedules = asked ? static_cast<std::uint32_t>(std::max(1, std::atoi(asked))) : 6;
  const Folder folder;
  int thrown = 0;
  for (const char* mode : modes) {
    for (const char* simulator : simulators) {
      for (std::uint32_t seed = 1; seed <= schedules; ++seed) {
        Config config = in_mode(mode);
        config.set(std::string("simulator.kind=") + simulator);
        config.set("simulator.device=host");
        config.set("log.level=off");
        config.edit().record.file = folder / "run.fathom";
        Engine engine(config);
        EntityDef floor;
        floor.physics = ground();
        engine.world().spawn(floor);
        Chaos chaos(engine, seed);
        const auto start = std::chrono::steady_clock::now();
        for (int runs = 0; runs < 2000 && engine.steps() < 60; ++runs) try {
            engine.run(60 - engine.steps());
          } catch (const std::runtime_error& error) {
            ASSERT_STREQ(error.what(), "chaos") << mode << ", " << simulator << ", seed " << seed;
            engine.set_paused(false);
          }
        thrown += chaos.thrown();
        EXPECT_EQ(engine.steps(), 60u) << mode << ", " << simulator << ", seed " << seed;
        EXPECT_EQ(engine.simulation().completed(), 60u);
        EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
        engine.finish();
        const ReplayResult result = replay(folder / "run.fathom", {.threads = 1, .device = "host"});
        EXPECT_FALSE(result.difference) << mode << ", " << simulator << ", seed " << seed;
        EXPECT_EQ(result.steps, 60u);
      }
    }
  }
  EXPECT_GT(thrown, asked ? 0 : 100);
}

}  // namespace
}  // namespace fathom::engine::test::engine_callbacks_test
