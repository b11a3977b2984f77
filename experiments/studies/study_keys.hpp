// Keys that studies of several kinds have; those of one kind are declared beside it.
#pragma once
#include <string>

#include "host/io/config.hpp"

namespace clerestory {

void add_thickness_keys(Schema& schema);  // study.thickness
void add_method_keys(Schema& schema);     // study.method: whose nets
void add_light_keys(Schema& schema);      // light.weights, light.gain
void add_maps_keys(Schema& schema);       // maps.weights
void add_rival_keys(Schema& schema);      // study.rival: whose nets stand beside
void add_incident_keys(Schema& schema);   // incident.*, data.maps: rooms with light along rays (lit_room_options)

/// For a caption: which photograph the nets see, and what is clamped.
std::string incident_text(const Config& config);

}  // namespace clerestory
