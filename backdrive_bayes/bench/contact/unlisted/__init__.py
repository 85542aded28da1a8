"""Effects that a diagnosis does not know: their true answer is `unknown`."""

from backdrive_bayes.bench.contact.unlisted import angle_channel, reducer_faults, torque_channel

UNLISTED = {
    "mains_hum": angle_channel.draw_hum,
    "mount_step": angle_channel.draw_step,
    "rocking_foot": angle_channel.draw_foot,
    "angle_scale": angle_channel.draw_scale,
    "missed_counts": angle_channel.draw_counts,
    "pitted_flank": reducer_faults.draw_pit,
    "broken_tooth": reducer_faults.draw_broken,
    "flank_wear": reducer_faults.draw_wear,
    "warming_contacts": reducer_faults.draw_warming,
    "eccentric_stage": reducer_faults.draw_eccentric,
    "torque_gain_wave": torque_channel.draw_gain,
    "torque_sensor_hysteresis": torque_channel.draw_hysteresis,
    "unseen_torque_ripple": torque_channel.draw_ripple,
}
"""Name on the bench -> draw(rng, reducer) of an effect with strength 0."""
