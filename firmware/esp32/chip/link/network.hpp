// Wi-Fi and UDP, for a device that has a key; without one neither is started.
#pragma once

#include "core/link/udp.hpp"
#include "esp_err.h"

namespace chladni::chip {

// Joins the network, and again whenever it is lost, in the background. Its radio is also what makes
// `network_random` unforeseeable, so datagrams begin after it.
esp_err_t network_start(const Network& network);

// Hand the datagrams that have come to the device; returns at once if there are none.
void network_poll(Datagrams& datagrams);

// To whoever sent the datagram that is being handled.
void network_send(const uint8_t* bytes, uint32_t count);

bool network_hmac(const uint8_t* key, const uint8_t* bytes, uint32_t count, uint8_t* mac);
uint32_t network_random();

}  // namespace chladni::chip
