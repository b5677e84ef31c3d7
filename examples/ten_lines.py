"""Learn a policy, drive it through camera images, follow one path, and draw the figures."""

import goalreach

policy = goalreach.train(seed=7)
result = goalreach.evaluate(policy, starts='paper', noise='nominal', seed=7)
print(f'{100 * result.success_rate:.0f} % of {len(result.paths)} paths reached the goal')
for frame in goalreach.simulate(policy, start=(1.2, 4.5, 90.0), seed=7):
    x_m, y_m, speed_m_per_s = frame.pose.x_m, frame.pose.y_m, frame.command.linear_m_per_s
    print(f'{frame.time_s:5.2f} s: at {x_m:.2f}, {y_m:.2f} m, driving {speed_m_per_s:.2f} m/s')
files = goalreach.figures(policy, result, out='figures')
print(f'{len(files)} figures in {files[0].parent}')
