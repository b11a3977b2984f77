// What is seen out of windows, made by rules from a seed: a sky with its sun or clouds, and what stands below it.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "tracer/scene.hpp"

namespace clerestory {

/// A daylight sky over houses, trees or hills, mean 1. Clear: Preetham, Shirley and Smits 1999, "A Practical Analytic
/// Model for Daylight", at a random turbidity and height of the sun, whose disc is as wide and as bright as 64 samples
/// resolve; overcast: Moon and Spencer 1942; or between the two. What a seed gives never changes: room files name it.
Panorama make_sky(std::uint64_t seed);
/// A clear one whose sun is four fifths as strong beside its sky as at noon. What a seed gives never changes.
Panorama make_sunny_sky(std::uint64_t seed);
/// Where that sun stands: radians from the panorama's centre to the right.
float sun_azimuth(std::uint64_t seed);

/// The name of a seed's sky in rooms and their files: "sky-" and 16 hexadecimal digits.
std::string sky_name(std::uint64_t seed);
/// The seed that such a name holds; nothing for other names.
std::optional<std::uint64_t> sky_seed(const std::string& name);
/// The same of sunny ones: "sun-".
std::string sunny_name(std::uint64_t seed);
std::optional<std::uint64_t> sunny_seed(const std::string& name);

}  // namespace clerestory
