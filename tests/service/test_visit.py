from service.procedures.visit import approach_signs


def test_the_approach_is_the_direction_of_the_last_motion_of_each_joint():
    signs = approach_signs(start=[0.0, 1.0, 0.5], target=[0.2, 0.1, 0.5], before=[-1, 1, -1])
    assert signs == [1, -1, -1]


def test_noise_of_a_standing_joint_is_no_motion():
    assert approach_signs(start=[0.50001], target=[0.5], before=[0]) == [0]
