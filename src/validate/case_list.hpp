// All cases, by source file.
#pragma once

#include "validate/record.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

// free_motion.cpp
void free_fall(const Setup& setup, Record& record);
void colliding_cloud(const Setup& setup, Record& record);
void torque_free(const Setup& setup, Record& record);
void tennis_racket(const Setup& setup, Record& record);
// friction.cpp
void ramps(const Setup& setup, Record& record);
void stopping_distance(const Setup& setup, Record& record);
void sliding_sphere(const Setup& setup, Record& record);
void spinning_box(const Setup& setup, Record& record);
// restitution.cpp
void rebound(const Setup& setup, Record& record);
void cradle(const Setup& setup, Record& record);
// contact_force.cpp
void stacked_balls(const Setup& setup, Record& record);
void impulse_balance(const Setup& setup, Record& record);
// simbenchmark.cpp
void bouncing(const Setup& setup, Record& record);
void spheres_666(const Setup& setup, Record& record);
void elastic_666(const Setup& setup, Record& record);
void rolling(const Setup& setup, Record& record);
void kapla(const Setup& setup, Record& record);
// stability.cpp
void tall_stack(const Setup& setup, Record& record);
void mass_ratios(const Setup& setup, Record& record);
void wall_pyramid(const Setup& setup, Record& record);
void sizes(const Setup& setup, Record& record);
void time_steps(const Setup& setup, Record& record);
// pressed_layers.cpp
void pressed_layers(const Setup& setup, Record& record);
// random_stacks.cpp
void random_stacks(const Setup& setup, Record& record);
// constructions.cpp
void card_house(const Setup& setup, Record& record);
void arch(const Setup& setup, Record& record);
void dominoes(const Setup& setup, Record& record);
void crossed_tower(const Setup& setup, Record& record);
void spinning_top(const Setup& setup, Record& record);
// standing.cpp
void standing_large_pyramid(const Setup& setup, Record& record);
void standing_walls(const Setup& setup, Record& record);
void standing_plates(const Setup& setup, Record& record);
void standing_heavy_on_light(const Setup& setup, Record& record);
void standing_stones(const Setup& setup, Record& record);
void standing_pyramids(const Setup& setup, Record& record);
// joints.cpp
void joint_pendulum(const Setup& setup, Record& record);
void joint_double_pendulum(const Setup& setup, Record& record);
void joint_heavy_chain(const Setup& setup, Record& record);
void joint_net(const Setup& setup, Record& record);
void joint_momentum(const Setup& setup, Record& record);
void joint_mechanisms(const Setup& setup, Record& record);
void joint_wedged(const Setup& setup, Record& record);
// heaps.cpp
void heaps(const Setup& setup, Record& record);
void heaps_on_surfaces(const Setup& setup, Record& record);
void heaps_with_joints(const Setup& setup, Record& record);
// seams.cpp
void seams(const Setup& setup, Record& record);
// tunnelling.cpp
void bullets(const Setup& setup, Record& record);
void spinning_rods(const Setup& setup, Record& record);
void boxes_into_wall(const Setup& setup, Record& record);
void random_shots(const Setup& setup, Record& record);
void free_shots(const Setup& setup, Record& record);
void near_misses(const Setup& setup, Record& record);
// far.cpp
void far_from_origin(const Setup& setup, Record& record);
// determinism.cpp
void golden_states(const Setup& setup, Record& record);
// hostile.cpp
void isolation(const Setup& setup, Record& record);
void extreme_values(const Setup& setup, Record& record);

}  // namespace fathom::validate
